"""An integrator's program that is run each time that the robot is stopped: to open a relay, say."""

from __future__ import annotations

import asyncio
import json
import logging

from nondum.host.config.stop_section import StopSection
from nondum.host.people.feedback import program
from nondum.host.people.stopping import Stopped
from nondum.sdk.errors import InstallFailed

log = logging.getLogger(__name__)

_FIX = "run it by hand; see `hook` under [stop]"


class StopHook:
    """Runs it, however often, each time to its end."""

    def __init__(self, section: StopSection) -> None:
        self._command, self._deadline_s = section.hook, section.hook_deadline_s
        self._running: set[asyncio.Task[None]] = set()
        self._problem: InstallFailed | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What every status says of it: that it failed the last time."""
        return (str(self._problem),) if self._problem is not None else ()

    def run_soon(self, stopped: Stopped) -> None:
        """Run it, if there is one; what was stopped is JSON at its standard input."""
        if self._command:
            task = asyncio.get_running_loop().create_task(self._run(stopped))
            self._running.add(task)
            task.add_done_callback(self._running.discard)

    async def close(self) -> None:
        """Wait for those that run: they may be what stops the robot."""
        await asyncio.gather(*self._running)

    async def _run(self, stopped: Stopped) -> None:
        data = json.dumps(stopped.to_dict()).encode() + b"\n"
        self._problem = None
        try:
            await program.succeed(self._command, {}, data, self._deadline_s, fix=_FIX)
        except InstallFailed as problem:
            log.error("%s", problem)  # of somebody else's program
            self._problem = problem
