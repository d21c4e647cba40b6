"""How far a payload has come on this host."""

from __future__ import annotations

from enum import Enum


class Step(Enum):
    """How far a payload has come on this host. `transitions.py` says what leads where."""

    RECEIVED = "received"
    """Its contents list was read; what this host needs of it is being copied to staging."""
    COPIED = "copied"
    """Each file that is needed lies in staging, hashed on the way; they are being checked."""
    VERIFIED = "verified"
    """Manifest, locks, index and wheels are sound and fit this host."""
    STAGED = "staged"
    """The checked copy is in its lasting place; the wheels are being unpacked into the store."""
    STORED = "stored"
    """All wheels are in the store and venvs linked from it; workers are asked what they are."""
    PROBED = "probed"
    """Each worker runs and said what the index says."""
    ACTIVE = "active"
    """Its components are in the catalogue and may act."""
    SUPERSEDED = "superseded"
    """Another release of it is active, or is tried first; it waits, installed, to come back."""
    REMOVING = "removing"
    """Withdrawn; its processes end and its files are deleted."""
    REFUSED = "refused"
    """It is not what it claims, or does not fit this host: nothing of it was kept."""
    QUARANTINED = "quarantined"
    """It could not be brought to life; it waits for a replug or a person."""
    GONE = "gone"
    """Not on this host, or not any more."""
