"""The instruments' drivers are no part of the host: they are taken from their own folders."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PLUGINS = (
    "compton-camera",
    "mobile-base",
    "pan-tilt-unit",
    "panorama",
    "people-detector",
    "pedestrian-detector",
    "thermal-camera",
    "visual-tracker",
)
sys.path += [str(ROOT / "plugins" / name) for name in PLUGINS]
