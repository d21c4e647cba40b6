"""A host that people talk to: it hears and speaks WAV files, in folders that its logs name."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from demo.robot import Robot, TooLate

LOOK_S = 0.2
LEARN_S = 30.0
HEARS = ("WAV files in ", " are heard")
SAYS = ("what is said is written to ", "")
HAS_LEARNT = ("", " phrases can be heard")


class Talking:
    """One host whose speech and speaker payloads are active."""

    def __init__(self, host: Robot) -> None:
        self._host = host

    def hear(self, sound: Path) -> None:
        """Have it hear a WAV file. Raises `TooLate`."""
        self._host.deliver(sound, self._folder("speech", HEARS))

    def has_learnt(self) -> None:
        """Wait until it knows what it may hear. Raises `TooLate`."""
        self._logged("speech", HAS_LEARNT)

    def said_since(self, wall_s: float) -> Sequence[tuple[float, Path]]:
        """What its speaker has said since then: when (seconds since 1970) and in which file,
        oldest first. Raises `TooLate`."""
        return self._host.written(self._folder("speaker", SAYS), wall_s)

    def _folder(self, component: str, ends: tuple[str, str]) -> Path:
        before, after = ends
        return Path(self._logged(component, ends).removeprefix(before).removesuffix(after))

    def _logged(self, component: str, ends: tuple[str, str]) -> str:
        """The newest line of a component's log that begins and ends so, once there is one."""
        before, after = ends
        deadline_s = time.monotonic() + LEARN_S * self._host.slowness
        while time.monotonic() < deadline_s:
            for row in reversed(self._host.ask("logs", component=component)):
                if row["message"].startswith(before) and row["message"].endswith(after):
                    return str(row["message"])
            time.sleep(LOOK_S)
        raise TooLate(f"{component} of {self._host.name} did not log “{before}…{after}”")
