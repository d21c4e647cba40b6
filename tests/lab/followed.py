"""nondum in a machine, looked at without being asked: its status is written down as it changes.

To ask takes an emulated processor two seconds each time, which those have not who try fifty things.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from tests.lab.installed import PATIENCE_S, REPLUGS, Installed, View

FOLLOW = """
mkdir -p /run/lab
cat >/run/lab/follow <<'END'
while :; do
    until [ -S /run/nondum/control.sock ]; do sleep 1; done
    nondum status --follow --json >/run/lab/status 2>/run/lab/follow.log
    : >/run/lab/status
    sleep 1
done
END
systemctl -q is-active lab-follow ||
    systemd-run -q --unit lab-follow -E PYTHONUNBUFFERED=1 /bin/sh /run/lab/follow
"""
LOOK = "tail -n 2 /run/lab/status 2>/dev/null"
EVERY_S = 0.5
T = TypeVar("T")


@dataclass(frozen=True)
class Stick:
    """An image, and where it is to be plugged in (None: anywhere)."""

    image: Path
    port: str | None = None


class Followed(Installed):
    """The same as `Installed`, with a status that may be a moment old, never of a past daemon."""

    @classmethod
    def follow(cls, host: Installed) -> Followed:
        """Begin to write its status down; again after each boot."""
        host.machine.run(FOLLOW)
        return cls(host.machine, host.name)

    def status(self) -> View | None:
        """The last status that was written; None while there is none."""
        lines = self.machine.attempt(LOOK).out.split("\n")[:-1]  # the last one is not whole
        if not lines:
            return None
        try:
            view: View = json.loads(lines[-1])
        except ValueError:  # tail began in the middle of a line that was just written
            return None
        return view

    def until(self, what: str, look: Callable[[View], T | None]) -> T:
        """Look at the status until there is something to see. Raises `AssertionError` with it."""

        def found() -> T | None:
            view = self.status()
            return look(view) if view is not None else None

        try:
            return self.machine.until(what, found, PATIENCE_S, EVERY_S)
        except AssertionError as error:
            raise AssertionError(f"{error}\nlast seen: {json.dumps(self.status())}") from error

    def bring_all(self, sticks: Mapping[str, Stick]) -> dict[str, str]:
        """Plug sticks in at once, payload by payload, and wait until all are active; answers their
        names for `pull`. Those whose drives stalled are plugged in again (see `bring`)."""
        names = {payload: self._plug(stick) for payload, stick in sticks.items()}
        for _ in range(REPLUGS):
            late = self.until("active or stalled", lambda view: _late(view, sticks))
            if not late:
                return names
            for payload in late:
                self.machine.pull(names[payload])
                self.machine.replugs += 1
                names[payload] = self._plug(sticks[payload])
        raise AssertionError(f"the drives of {sorted(late)} stalled {REPLUGS} times")

    def _plug(self, stick: Stick) -> str:
        return self.machine.plug(stick.image, port=stick.port)


def _late(view: View, wanted: Mapping[str, Stick]) -> set[str] | None:
    """Payloads that are kept from being active by drives that do not answer; None: that is not
    known yet."""
    states = {row["payload"]: row["state"] for row in view["payloads"]}
    late = {payload for payload in wanted if states.get(payload) != "active"}
    if not late:
        return late
    stalled = [d for d in view["drives"] if any("DRIVE_STALLED" in p for p in d["problems"])]
    is_at_rest = all(drive["state"] == "idle" for drive in view["drives"])
    return late if is_at_rest and len(stalled) >= len(late) and not late & states.keys() else None
