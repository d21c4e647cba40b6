"""Sounds, by a program that plays what it reads: aplay(1), for instance."""

from __future__ import annotations

from collections.abc import Sequence

from nondum.host.core.feedback_state import State, StateReason
from nondum.host.people.feedback import program
from nondum.sdk.errors import InstallFailed, Problem
from nondum_host_lamps.tones import TUNES, wav

PLAY_S = 5.0
"""A tune takes one second at most; a sound card may be busy for a while."""


class Player:
    """Plays the tune of each state as a WAV file; satisfies `Output`."""

    def __init__(self, command: Sequence[str]) -> None:
        self._command = tuple(command)
        self._last: State | None = None

    async def show(self, reason: StateReason) -> None:
        """Play it, unless it is the same as before. Raises `InstallFailed` (SOUND_FAILED)."""
        if reason.state is self._last:
            return
        self._last = reason.state
        data = wav(TUNES[reason.state])
        try:
            ended = await program.run(self._command, {}, data, PLAY_S)
        except OSError as error:
            raise self._failed(f"cannot be run ({error.strerror})") from error
        if ended.status != 0:
            how = "it hung" if ended.status is None else f"status {ended.status}"
            raise self._failed(f"does not play ({how}) {ended.output[:200]}".strip())

    async def end(self) -> None:
        """A tune that plays is cut off with its program."""

    def _failed(self, text: str) -> InstallFailed:
        fix = "see `player` under [feedback]; may the daemon's user open the sound card?"
        return InstallFailed(Problem("SOUND_FAILED", text, where=self._command[0], fix=fix))
