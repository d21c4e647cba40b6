"""The pan-tilt unit itself: its commands, one at a time, each answered or a failure with its code.

Source: Directed Perception, PTU-D46 User's Manual, version 2.14.0 (2006), section 4. Codes:
PTU_SILENT (no answer), PTU_REFUSED (the unit said no, in its own words), PTU_LIMIT_HIT (it ran into
its end and lost count), PTU_STALLED (it does not get there), PTU_OUT_OF_REACH (from `aim`).
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from nondum.sdk.errors import BehaviourFailed, Problem
from nondum.sdk.serial_line import SerialLine
from nondum_pan_tilt_unit.aim import Axis
from nondum_pan_tilt_unit.replies import LimitHit, Replies, Reply

BAUD = 9600
ANSWER_S = 3.0
_RESET_S = 60.0
_QUIET_S = 0.1
_CHATTER = 100
"""How many pieces of old output are read and dropped, at most."""
_POLL_S = 0.05
_SETTLE_STEPS = 1
_MARGIN_S = 3.0
_INITIAL = ("FT", "ED", "CI", "I", "LE")
"""Terse, no echo, speeds independent of positions, immediate execution, limits enforced."""


@dataclass(frozen=True, slots=True)
class Aim:
    """Both motors' steps."""

    pan: int
    tilt: int


class Head:
    """A unit that has been set up by `ready`."""

    def __init__(self, line: SerialLine, *, answer_s: float = ANSWER_S) -> None:
        """`answer_s`: how long a command's answer is waited for."""
        self._line, self._answer_s = line, answer_s
        self._replies = Replies()
        self._waiting: deque[Reply] = deque()
        self.pan = Axis("pan", 1.0, 0, 0)
        self.tilt = Axis("tilt", 1.0, 0, 0)
        self._steps_per_s = 1

    async def ready(self, *, speed_rad_s: float, reset: bool = False) -> None:
        """Bring the unit from any state to a known one, and ask for its geometry.

        `reset` drives both axes to their ends first, which a unit does by itself at power-up.
        """
        await self._clear()
        for command in _INITIAL:
            await self.command(command)
        if reset:
            await self.command("R", within_s=_RESET_S, may_hit=True)
        self.pan = await self._axis("pan", "P")
        self.tilt = await self._axis("tilt", "T")
        self._steps_per_s = await self._set_speed(speed_rad_s)

    async def command(
        self, text: str, *, within_s: float | None = None, may_hit: bool = False
    ) -> str:
        """Send one command, give the text of its answer. `may_hit`: running into ends is meant."""
        within_s = self._answer_s if within_s is None else within_s
        self._line.send(text.encode("ascii") + b" ")
        try:
            async with asyncio.timeout(within_s):
                reply = await self._reply(may_hit=may_hit)
        except TimeoutError:
            raise _failed("PTU_SILENT", f"no answer to {text!r} within {within_s:g} s") from None
        if not reply.is_success:
            raise _failed("PTU_REFUSED", f"the unit refused {text!r}: {reply.text}")
        return reply.text

    async def query(self, text: str) -> float:
        """Send a query whose answer is a number."""
        answer = await self.command(text)
        try:
            return float(answer.split()[0])
        except (IndexError, ValueError):
            raise _failed("PTU_REFUSED", f"{answer!r} is no answer to {text!r}") from None

    async def position(self) -> Aim:
        """Where the unit says it is."""
        return Aim(round(await self.query("PP")), round(await self.query("TP")))

    async def turn(self, aim: Aim) -> None:
        """Move both axes and return when the unit reports that they have arrived."""
        start = await self.position()
        await self.command(f"PP{aim.pan}")
        await self.command(f"TP{aim.tilt}")
        longest = max(abs(start.pan - aim.pan), abs(start.tilt - aim.tilt))
        within_s = _MARGIN_S + 2 * longest / self._steps_per_s
        try:
            async with asyncio.timeout(within_s):
                await self._arrival(aim)
        except TimeoutError:
            message = f"the unit did not reach {aim.pan}, {aim.tilt} within {within_s:.0f} s"
            raise _failed("PTU_STALLED", message) from None

    def halt(self) -> None:
        """Stop both axes, without waiting for the answer: also for the way out."""
        self._line.send(b"H ")

    async def _arrival(self, aim: Aim) -> None:
        """Ask until it is there. (`A` would tell by itself, but blocks even the halt command.)"""
        while True:
            if is_at(await self.position(), aim):
                return
            await asyncio.sleep(_POLL_S)

    async def _axis(self, name: str, letter: str) -> Axis:
        arcsec, minimum, maximum = [await self.query(letter + what) for what in "RNX"]
        return Axis.reported(name, arcsec, minimum, maximum)

    async def _set_speed(self, speed_rad_s: float) -> int:
        """Set both axes' speed, within the unit's bounds; the slower one, in steps/s."""
        speeds = []
        for letter, axis in (("P", self.pan), ("T", self.tilt)):
            low, high = await self.query(f"{letter}L"), await self.query(f"{letter}U")
            speed = round(min(max(speed_rad_s / axis.resolution_rad, low), high))
            await self.command(f"{letter}S{speed}")
            speeds.append(speed)
        return min(speeds)

    async def _reply(self, *, may_hit: bool) -> Reply:
        while not self._waiting:
            pieces = self._replies.feed(await self._line.receive())
            if not may_hit:
                _refuse_hits(pieces)
            self._waiting += [piece for piece in pieces if isinstance(piece, Reply)]
        return self._waiting.popleft()

    async def _clear(self) -> None:
        """End a command that someone left half typed, and drop all answers to what was before."""
        self._line.send(b"\r")
        for _ in range(_CHATTER):
            try:
                async with asyncio.timeout(_QUIET_S):
                    await self._line.receive()
            except TimeoutError:
                self._replies.clear()
                self._waiting.clear()
                return
        raise _failed("PTU_REFUSED", "the device never stops talking: it is no pan-tilt unit")


def is_at(position: Aim, aim: Aim) -> bool:
    """Whether a reported position is the one aimed at."""
    return max(abs(position.pan - aim.pan), abs(position.tilt - aim.tilt)) <= _SETTLE_STEPS


def _refuse_hits(pieces: Sequence[Reply | LimitHit]) -> None:
    for piece in pieces:
        if isinstance(piece, LimitHit):
            raise _failed(
                "PTU_LIMIT_HIT",
                f"{piece.axis} ran into its end: the unit has lost count of its steps",
                fix="free the head, then set `reset = true` or switch the unit off and on",
            )


def _failed(code: str, message: str, *, fix: str = "") -> BehaviourFailed:
    return BehaviourFailed(Problem(code, message, where="pan-tilt unit", fix=fix))
