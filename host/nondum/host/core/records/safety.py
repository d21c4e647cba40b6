"""Which payloads a daemon leaves alone."""

from __future__ import annotations

from enum import Enum


class Safety(Enum):
    """Which payloads a daemon leaves alone, since daemons before it died, or a person says so."""

    OFF = "off"
    """None: it is as always."""
    INITIAL = "initial"
    """What drives and other hosts bring: only what was installed for good may be at work."""
    NOTHING = "nothing"
    """All of them."""
