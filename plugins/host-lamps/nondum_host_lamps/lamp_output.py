"""Lamps as an output: by root itself, or by the helper."""

from __future__ import annotations

from pathlib import Path

from nondum.host.core.feedback_state import StateReason
from nondum.host.core.keyed_queues import in_thread
from nondum.host.sandbox.helper import privileged


class LampOutput:
    """Shows states on lamps; satisfies `Output`."""

    def __init__(self, names: tuple[str, ...], kept: Path) -> None:
        """`kept`: a file for what they showed before, should there be no helper to know it."""
        self._names, self._kept = names, kept

    async def show(self, reason: StateReason) -> None:
        """Show it. Raises `NondumError`."""
        await in_thread(privileged().show_lamps, self._names, reason.state, self._kept)

    async def end(self) -> None:
        """Have them show what they showed before."""
        await in_thread(privileged().end_lamps, self._names, self._kept)
