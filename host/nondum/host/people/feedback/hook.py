"""The hook: an integrator's program that is told every state."""

from __future__ import annotations

import json
from collections.abc import Sequence

from nondum.host.core.feedback_state import StateReason
from nondum.host.people.feedback import program

_FIX = "run it by hand with the same arguments; see `hook` under [feedback]"


class Hook:
    """Runs it for each state, never twice at once; satisfies `Output`."""

    def __init__(self, command: Sequence[str], deadline_s: float) -> None:
        self._command, self._deadline_s = tuple(command), deadline_s

    async def show(self, reason: StateReason) -> None:
        """Run it: state, code, payload and sentence as arguments and in the environment, all of it
        as JSON at its standard input. Raises `InstallFailed` (PROGRAM_FAILED, PROGRAM_OVERDUE)."""
        told = {name: program.printable(text) for name, text in reason.to_dict().items()}
        arguments = [told[name] for name in ("state", "code", "payload", "sentence")]
        environment = {f"NONDUM_{name.upper()}": text for name, text in told.items()}
        data = json.dumps(told).encode() + b"\n"
        command = [*self._command, *arguments]
        await program.succeed(command, environment, data, self._deadline_s, fix=_FIX)

    async def end(self) -> None:
        """Nothing is left: each run has ended."""
