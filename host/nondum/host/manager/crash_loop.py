"""Crash-loop counter: how many daemons in a row died soon after they started. It is kept in a
separate file, since the catalogue may be what they die of."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from pathlib import Path

from nondum.host.core.events.daemon import HostStarted
from nondum.host.core.events.event import Event
from nondum.host.core.keyed_queues import in_thread
from nondum.host.core.records.safety import Safety
from nondum.host.lifecycle import safe_mode
from nondum.wheelhouse.store import disk

SOON_S = 60.0
"""A daemon that lives this long once it serves has not died soon."""
COMMAND_LINE = Path("/proc/cmdline")

log = logging.getLogger(__name__)


class CrashCounter:
    """Counts one host's daemons. Methods but `on_event` and `outlive` block."""

    def __init__(self, state: Path, *, soon_s: float = SOON_S) -> None:
        """`state` is the state folder: it keeps `deaths`; people may put a file `safe` there."""
        self._deaths, self._asked = state / "deaths", state / "safe"
        self._serves = asyncio.Event()
        self._soon_s = soon_s
        self._is_asked = False
        """Whether a person wants this daemon in safe mode."""
        self.deaths = 0
        """How many daemons in a row died soon, this one not counted."""

    def begin(self, asked: Safety = Safety.OFF) -> tuple[Safety, str]:
        """Count this daemon as dead until it is known better; answers what it may have at work, and
        why. `asked` is what the command line says."""
        deaths = self.deaths = self._read()
        self._write(deaths + 1)
        command_line = _text(COMMAND_LINE)
        file = safe_mode.said(_text(self._asked)) if self._asked.exists() else Safety.OFF
        asked_for = {
            "a person asked for it as it was started": asked,
            f"`{safe_mode.KERNEL_WORD}` is on the kernel's command line": (
                safe_mode.asked_of_kernel(command_line)
            ),
            f"there is {self._asked}": file,
        }
        self._is_asked = safe_mode.strictest(asked_for.values()) is not Safety.OFF
        of_deaths = safe_mode.after_deaths(deaths)
        found = {f"{deaths} daemons in a row died soon": of_deaths, **asked_for}
        safety = safe_mode.strictest(found.values())
        whys = [why for why, wanted in found.items() if wanted is safety is not Safety.OFF]
        return safety, "; ".join(whys)

    def clear(self) -> None:
        """All is well: the next daemon counts from nothing."""
        if self._read():
            self._write(0)

    def warnings(self) -> tuple[str, ...]:
        """How many more deaths lead to safe mode, where there were any."""
        deaths = self.deaths
        if not 0 < deaths < safe_mode.DEATHS:
            return ()
        died = "1 daemon" if deaths == 1 else f"{deaths} daemons in a row"
        return (f"{died} died soon after the start; after {safe_mode.DEATHS} comes safe mode",)

    async def may_leave_safe_mode(self) -> bool:
        """Whether this daemon, which has lasted, may leave safe mode: no person asked for that. If
        it dies of leaving before `outlive` is done, the next one is in safe mode again."""
        if self._is_asked:
            return False
        await in_thread(self._write, safe_mode.DEATHS)
        return True

    def on_event(self, event: Event) -> None:
        """The while begins once the daemon serves."""
        if isinstance(event, HostStarted):
            self._serves.set()

    async def outlive(self) -> None:
        """Clear it once this daemon has lived long enough."""
        await self._serves.wait()
        await asyncio.sleep(self._soon_s)
        await in_thread(self.clear)
        self.deaths = 0

    def _read(self) -> int:
        text = _text(self._deaths).strip()
        return min(int(text), safe_mode.MORE_DEATHS) if text.isdecimal() else 0

    def _write(self, deaths: int) -> None:
        """A host whose disk is full or damaged goes on; it is only not counted."""
        try:
            if deaths:
                # A daemon that takes the machine down at once is counted, too.
                disk.write(self._deaths, b"%d\n" % deaths)
            else:
                self._deaths.unlink(missing_ok=True)
        except OSError as error:
            log.warning("deaths of daemons are not counted: %s", error)


def _text(path: Path) -> str:
    with contextlib.suppress(OSError, UnicodeDecodeError):
        return path.read_text(encoding="utf-8")
    return ""
