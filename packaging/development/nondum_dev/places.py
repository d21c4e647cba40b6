"""Where things are in the checkout."""

from __future__ import annotations

from pathlib import Path

PACKAGING = Path(__file__).parents[2]
CHECKOUT = PACKAGING.parent
LOCK = PACKAGING / "development/requirements.lock"
LOCK_NAME = str(LOCK.relative_to(CHECKOUT))
