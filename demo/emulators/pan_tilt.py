"""A pan-tilt unit of the PTU-D46 class as its serial port shows it.

Commands and replies: Directed Perception, PTU-D46 User's Manual, version 2.14.0 (2006), section 4.
Factory settings: echo on, verbose feedback, limits enforced, immediate execution.
"""

from __future__ import annotations

import math
import re
from collections import deque
from collections.abc import Callable

from demo.emulators.axis import Axis

_COMMAND = re.compile(r"([A-Z]+)(-?\d+)?")
_BANNER = "Pan-Tilt Controller v2.14.0(C14/E), (C)2006 Directed Perception, Inc., emulated"


class Rejected(Exception):
    """The text of a `! ` reply."""


class PanTiltUnit:
    """Two axes and the interpreter of their commands."""

    def __init__(self, pan_rad: float = 0.0, tilt_rad: float = 0.0) -> None:
        self.pan = Axis("Pan", -3090, 3090)
        self.tilt = Axis("Tilt", -907, 604)
        for axis, angle in ((self.pan, pan_rad), (self.tilt, tilt_rad)):
            axis.target = round(math.degrees(angle) * 3600 / axis.resolution_arcsec)
            axis.position = float(axis.target)
        self._echo = True
        self._verbose = True
        self._limits = True
        self._slaved = False
        self._pending: dict[str, int] = {}
        self._typed = bytearray()
        self._waiting: list[str] = []
        self._awaited: Callable[[], str | None] | None = None

    def seize(self) -> None:
        """Stick both gears: the motors go on stepping, the head stays."""
        self.pan.seize()
        self.tilt.seize()

    def receive(self, data: bytes) -> bytes:
        """Take bytes off the line; give what is answered at once."""
        answer = bytearray()
        for byte in data:
            if self._echo:
                answer.append(byte)
            if byte in b" \r":
                self._waiting += [self._typed.decode("ascii", "replace").upper()]
                self._typed.clear()
                answer += self._work()
            elif byte != ord("\n"):
                self._typed.append(byte)
        return bytes(answer)

    def advance(self, dt_s: float) -> bytes:
        """Let time pass; give what is answered late (`A` and `R`)."""
        self.pan.advance(dt_s)
        self.tilt.advance(dt_s)
        return self._work()

    def _work(self) -> bytes:
        """Answer waiting commands until one has to wait for the axes."""
        answer = bytearray()
        while True:
            if self._awaited is not None:
                late = self._awaited()
                if late is None:
                    return bytes(answer)
                self._awaited = None
                answer += f"{late}\r\n".encode()
            if not self._waiting:
                return bytes(answer)
            command = self._waiting.pop(0)
            if command:
                answer += self._answer(command)

    def _answer(self, command: str) -> bytes:
        try:
            said = self._do(command)
        except Rejected as error:
            return f"! {error}\r\n".encode()
        if self._awaited is not None:
            return b""
        return f"* {said}\r\n".encode() if said else b"*\r\n"

    def _do(self, command: str) -> str:
        match = _COMMAND.fullmatch(command)
        if match is None:
            raise Rejected(f"Illegal command entered: {command}")
        name, number = match[1], None if match[2] is None else int(match[2])
        if name in self._modes and number is None:
            return self._modes[name](self)
        axis = {"P": self.pan, "T": self.tilt}.get(name[0])
        if axis is not None and name[1:] in _READINGS and number is None:
            return self._read(axis, name[1:])
        if axis is not None and name[1:] in _SETTINGS and number is not None:
            return self._set(axis, name[1:], number)
        raise Rejected(f"Illegal command entered: {command}")

    def _read(self, axis: Axis, what: str) -> str:
        phrase, value = _READINGS[what](axis)
        return f"{phrase.format(axis=axis.name, value=value)}" if self._verbose else str(value)

    def _set(self, axis: Axis, what: str, number: int) -> str:
        if what in ("P", "O"):
            wanted = number + (round(axis.position) if what == "O" else 0)
            self._check_position(axis, wanted)
            if self._slaved:
                self._pending[axis.name] = wanted
            else:
                axis.target = wanted
        elif what == "S":
            self._check_speed(axis, number)
            axis.speed = number
        else:
            setattr(axis, _SETTINGS[what], number)
        return ""

    def _check_position(self, axis: Axis, wanted: int) -> None:
        if not self._limits:
            return
        if wanted > axis.maximum:
            raise Rejected(f"Maximum allowable {axis.name} position is {axis.maximum}")
        if wanted < axis.minimum:
            raise Rejected(f"Minimum allowable {axis.name} position is {axis.minimum}")

    def _check_speed(self, axis: Axis, wanted: int) -> None:
        if wanted > axis.upper_speed:
            raise Rejected(f"{axis.name} speed cannot exceed {axis.upper_speed} positions/sec")
        if wanted < axis.lower_speed:
            raise Rejected(f"Motor speed cannot be less than {axis.lower_speed} pos/sec")

    def _set_echo(self, *, on: bool) -> str:
        self._echo = on
        return ""

    def _set_verbose(self, *, on: bool) -> str:
        self._verbose = on
        return ""

    def _set_limits(self, *, on: bool) -> str:
        self._limits = on
        return ""

    def _set_slaved(self, *, on: bool) -> str:
        self._slaved = on
        return ""

    def _await(self) -> str:
        for axis in (self.pan, self.tilt):
            axis.target = self._pending.pop(axis.name, axis.target)
        self._awaited = lambda: None if self.pan.is_moving or self.tilt.is_moving else "*"
        return ""

    def _halt(self, *axes: str) -> str:
        for axis in (self.pan, self.tilt):
            if axis.name in axes:
                axis.halt()
        return ""

    def _reset(self) -> str:
        """Find both ends of both axes, then go home; it is answered when that is done."""
        ends = deque(
            (axis, end) for axis in (self.tilt, self.pan) for end in (axis.minimum, axis.maximum, 0)
        )

        def progress() -> str | None:
            while not (self.tilt.is_moving or self.pan.is_moving):
                if not ends:
                    return "!T!T!P!P*"
                axis, end = ends.popleft()
                axis.target = end
            return None

        self._awaited = progress
        return ""

    _modes: dict[str, Callable[[PanTiltUnit], str]] = {  # noqa: RUF012 - never changed
        "A": _await,
        "E": lambda self: "Echoing ON" if self._echo else "Echoing OFF",
        "EE": lambda self: self._set_echo(on=True),
        "ED": lambda self: self._set_echo(on=False),
        "F": lambda self: "ASCII verbose mode" if self._verbose else "ASCII terse mode",
        "FV": lambda self: self._set_verbose(on=True),
        "FT": lambda self: self._set_verbose(on=False),
        "L": lambda self: (
            "Limit bounds are ENABLED (soft limits enabled)"
            if self._limits
            else "Limit bounds are DISABLED (hard limits only: use care)"
        ),
        "LE": lambda self: self._set_limits(on=True),
        "LD": lambda self: self._set_limits(on=False),
        "I": lambda self: self._set_slaved(on=False),
        "S": lambda self: self._set_slaved(on=True),
        "CI": lambda self: "",
        "H": lambda self: self._halt("Pan", "Tilt"),
        "HP": lambda self: self._halt("Pan"),
        "HT": lambda self: self._halt("Tilt"),
        "R": _reset,
        "O": lambda self: "Input 24 VDC @ 95 degF",
        "V": lambda self: _BANNER,
    }


_READINGS: dict[str, Callable[[Axis], tuple[str, object]]] = {
    "P": lambda axis: ("Current {axis} position is {value}", round(axis.position)),
    "O": lambda axis: ("Target {axis} position is {value}", axis.target),
    "R": lambda axis: ("{value} seconds arc per position", axis.resolution_arcsec),
    "N": lambda axis: ("Minimum {axis} position is {value}", axis.minimum),
    "X": lambda axis: ("Maximum {axis} position is {value}", axis.maximum),
    "S": lambda axis: ("Target {axis} speed is {value} positions/sec", axis.speed),
    "A": lambda axis: ("{axis} acceleration is {value} positions/sec^2", axis.acceleration),
    "B": lambda axis: ("Current {axis} base speed is {value} positions/sec", axis.base_speed),
    "U": lambda axis: ("Maximum {axis} speed is {value} positions/sec", axis.upper_speed),
    "L": lambda axis: ("Minimum {axis} speed is {value} positions/sec", axis.lower_speed),
}
_SETTINGS = {
    "P": "target",
    "O": "target",
    "S": "speed",
    "A": "acceleration",
    "B": "base_speed",
    "U": "upper_speed",
    "L": "lower_speed",
}
