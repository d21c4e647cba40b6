"""Where things are in the checkout."""

from __future__ import annotations

import sys
from pathlib import Path

PACKAGING = Path(__file__).parents[2]
CHECKOUT = PACKAGING.parent
LOCK = PACKAGING / "development/requirements.lock"
LOCK_NAME = str(LOCK.relative_to(CHECKOUT))
BESIDE = Path(sys.prefix) / "beside"
"""What is installed beside the environment of the Python that runs this, for who looks there."""
