"""A bench with a pan-tilt unit and a relay on pseudo-terminals, served from a thread.

The unit here is as simple as the protocol lets one be (it is there the moment it is told), and does
on demand what real ones do on bad days.
"""

from __future__ import annotations

import os
import pty
import re
import select
import threading
import tty
from collections.abc import Callable

_SWITCHING = re.compile(rb"\xa0\x01[\x00\x01].", re.DOTALL)


class Bench:
    """What is on the table: two ports, and what went through them."""

    def __init__(self) -> None:
        self.commands: list[str] = []
        """Every command that the unit was sent, in order."""
        self.position = {"P": 300, "T": -100}
        self.light: list[bool] = []
        """Every switching of the laser, in order."""
        self.order: list[str] = []
        """Commands and switchings, in order."""
        self._changed = threading.Condition()
        self.is_echoing = True
        self.is_silent = False
        self.is_seized = False
        self.hits = b""
        """Sent before the next answer: `!P` or `!T`."""
        self._ports = {name: _open() for name in ("head", "relay")}
        self._wake, self._stop = os.pipe()
        self._unplugged = False
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def node(self, name: str) -> str:
        return os.ttyname(self._ports[name][1])

    def wait_until(self, is_so: Callable[[], bool], timeout_s: float = 30.0) -> None:
        """Wait for what the plugin does to the bench."""
        with self._changed:
            assert self._changed.wait_for(is_so, timeout_s), self.order

    def noise(self, data: bytes) -> None:
        """Bytes from the unit that answer no command."""
        os.write(self._ports["head"][0], data)

    def unplug(self) -> None:
        """The adapter's end goes away, as when its cable is pulled."""
        self._end()
        for ours, _ in self._ports.values():
            os.close(ours)
        self._unplugged = True

    def close(self) -> None:
        if not self._unplugged:
            self.unplug()
        for descriptor in (*(theirs for _, theirs in self._ports.values()), self._wake, self._stop):
            os.close(descriptor)

    def _end(self) -> None:
        os.write(self._stop, b"x")
        self._thread.join()

    def _serve(self) -> None:
        head, relay = (self._ports[name][0] for name in ("head", "relay"))
        typed, switched = "", b""
        while True:
            ready, _, _ = select.select([head, relay, self._wake], [], [])
            if self._wake in ready:
                return
            if relay in ready:
                switched += os.read(relay, 64)
                for command in _SWITCHING.findall(switched):
                    self.order.append("laser on" if command[2] else "laser off")
                    self.light.append(bool(command[2]))
                switched = switched[len(switched) // 4 * 4 :]
            if head in ready:
                *commands, typed = re.split("[ \r]", typed + os.read(head, 256).decode())
                os.write(head, b"".join(self._answer(command) for command in commands if command))

            with self._changed:
                self._changed.notify_all()

    def _answer(self, command: str) -> bytes:
        self.commands.append(command)
        self.order.append(command)
        if self.is_silent:
            return b""
        echo = f"{command} ".encode() if self.is_echoing else b""
        self.is_echoing = self.is_echoing and command != "ED"
        hits, self.hits = self.hits, b""
        return echo + hits + self._said(command).encode() + b"\r\n"

    def _said(self, command: str) -> str:
        axis, number = command[0], command[2:]
        if re.fullmatch(r"[PT]P-?\d+", command):
            if not self.is_seized:
                self.position[axis] = int(number)
            return "*"
        readings = {
            **{f"{axis}P": at for axis, at in self.position.items()},
            **{"PN": -3090, "PX": 3090, "TN": -907, "TX": 604},
            **{"PR": 185.1428, "TR": 185.1428, "PL": 31, "PU": 2902, "TL": 31, "TU": 2902},
        }
        if command == "R":
            return "!T!T!P!P*"
        if command in readings:
            return f"* {readings[command]}"
        if command in {"ED", "FT", "CI", "I", "LE", "H"} or command[1] == "S":
            return "*"
        return f"! Illegal command entered: {command}"


def _open() -> tuple[int, int]:
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    return ours, theirs
