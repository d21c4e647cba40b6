"""The hook: an integrator's program that is told every state."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence

from nondum.host.feedback import program
from nondum.host.feedback.state import Concern
from nondum.sdk.errors import InstallFailed, Problem

log = logging.getLogger(__name__)

_FIX = "run it by hand with the same arguments; see `hook` under [feedback]"


class Hook:
    """Runs it for each state, never twice at once; satisfies `Output`."""

    def __init__(self, command: Sequence[str], deadline_s: float) -> None:
        self._command, self._deadline_s = tuple(command), deadline_s

    async def show(self, concern: Concern) -> None:
        """Run it: state, code, payload and sentence as arguments and in the environment, all of it
        as JSON at its standard input. Raises `InstallFailed` (PROGRAM_FAILED, PROGRAM_OVERDUE)."""
        told = {name: _printable(text) for name, text in concern.to_dict().items()}
        arguments = [told[name] for name in ("state", "code", "payload", "sentence")]
        environment = {f"NONDUM_{name.upper()}": text for name, text in told.items()}
        data = json.dumps(told).encode() + b"\n"
        command = [*self._command, *arguments]
        try:
            ended = await program.run(command, environment, data, self._deadline_s)
        except OSError as error:
            text = f"cannot be run ({error.strerror})"
            raise InstallFailed(
                Problem("PROGRAM_FAILED", text, where=self._command[0], fix=_FIX)
            ) from error
        for line in ended.output.splitlines():
            log.info("hook: %s", _printable(line))
        if ended.status is None:
            text = f"was killed: it had not ended after {self._deadline_s:g} s"
            raise InstallFailed(Problem("PROGRAM_OVERDUE", text, where=self._command[0], fix=_FIX))
        if ended.status != 0:
            text = f"ended with status {ended.status}"
            raise InstallFailed(Problem("PROGRAM_FAILED", text, where=self._command[0], fix=_FIX))

    async def end(self) -> None:
        """Nothing is left: each run has ended."""


def _printable(text: str) -> str:
    """Strangers' words, as arguments and log lines can carry them.

    >>> _printable("a\\x00b\\nc")
    'a b c'
    """
    return "".join(letter if letter.isprintable() else " " for letter in text)
