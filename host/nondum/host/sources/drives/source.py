"""The seam that sources of drives stand behind."""

from __future__ import annotations

from typing import Protocol

from nondum.host.core.events.event import Emit


class DriveSource(Protocol):
    """Tells drives that come and go."""

    kind: str
    """The `kind` of its drives; one source for each kind."""

    async def watch(self, emit: Emit) -> None:
        """Emit `DriveInserted` for what is there, then `DrivesScanned`, then what comes and goes.

        Runs until cancelled; leaves nothing open then.
        """
        ...
