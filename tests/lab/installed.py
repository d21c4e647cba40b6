"""nondum in a machine: installed, configured, started, and met as its operator meets it."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from tests.lab.machine import Machine

PATIENCE_S = 400.0
CONFIGURATION = """
[host]
name = "{name}"
[drives]
allow_unsigned = true
look_s = 60.0
[peers]
enabled = {has_peers}
[planning]
establish_s = 300
[workers]
startup_s = 200
"""
"""Emulated processors that others share are slow: nothing here is judged by its time."""
INSTALL = """
set -eu
grep -q nondum /etc/fstab || echo 'LABEL=nondum /opt/nondum ext4 ro,nofail 0 0' >>/etc/fstab
systemctl daemon-reload
mount /opt/nondum
ln -sf /opt/nondum/bin/nondum /usr/local/bin/nondum
cp /opt/nondum/packaging/systemd/*.service /etc/systemd/system/
cp /opt/nondum/packaging/systemd/*.s[!e]* /etc/systemd/system/ 2>/dev/null || true
cp /opt/nondum/packaging/sysusers.d/*.conf /usr/lib/sysusers.d/ 2>/dev/null || true
cp /opt/nondum/packaging/tmpfiles.d/*.conf /usr/lib/tmpfiles.d/ 2>/dev/null || true
systemd-sysusers
systemd-tmpfiles --create
systemctl daemon-reload
systemctl -q enable nondum.service
sync  # power may be cut next
"""
PATIENT = "/etc/systemd/system/nondum.service.d/lab.conf"
PATIENCE = "[Service]\nTimeoutStartSec={start:.0f}\nWatchdogSec={alive:.0f}\n"
"""Machines whose processors are emulated, and shared, get more time than real ones."""
START_S, ALIVE_S = 600.0, 300.0
SERVICE = "nondum.service"
NAME = "spot"
LOOK_S = 2.0
"""Between two looks at the status: each takes a second of an emulated processor."""
REPLUGS = 3
STARVED = ("DRIVE_STALLED", "HELPER_SILENT")
"""What is told of a drive when an emulated processor had to wait for a real one."""
T = TypeVar("T")
View = dict[str, Any]


class Installed:
    """The nondum of one machine."""

    def __init__(self, machine: Machine, name: str = NAME) -> None:
        """`name` is what the host is called; it looks for others where it has a network."""
        self.machine, self.name = machine, name

    def install(self) -> None:
        """Install it from the machine's first further disk; nothing is started."""
        self.configure()
        self.be_patient()
        self.machine.run(INSTALL)

    def be_patient(self) -> None:
        """Have systemd give the service the time that an emulated processor takes."""
        slowness = self.machine.slowness
        patience = PATIENCE.format(start=START_S * slowness, alive=ALIVE_S * slowness)
        self.machine.put(PATIENT, patience)

    def configure(self, more: str = "") -> None:
        """Write its configuration, with some more lines of its table `[workers]`."""
        has_peers = "true" if self.machine.socket else "false"
        text = CONFIGURATION.format(name=self.name, has_peers=has_peers)
        self.machine.put("/etc/nondum/host.toml", text + more)

    def start(self) -> None:
        """Start the service and wait until its command line is answered.

        Raises `AssertionError`, with what it said, when systemd has to start it again.
        """
        self.machine.run(f"systemctl start {SERVICE}", timeout_s=START_S)
        self.machine.until("an answer", self._first_answer, PATIENCE_S)

    def begin_to_start(self) -> None:
        """Have systemd start the service, and wait for nothing: `start` must follow."""
        self.machine.run(f"systemctl start --no-block {SERVICE}", timeout_s=PATIENCE_S)

    def wait_until_started(self) -> None:
        """Wait until the daemon answers, however the service was started."""
        self.until("an answer", lambda view: view)

    def stop(self) -> None:
        """Stop the service."""
        self.machine.run(f"systemctl stop {SERVICE}", timeout_s=PATIENCE_S)

    def forget(self) -> None:
        """Stop the service, and delete all that it knows."""
        self.stop()
        self.machine.run("rm -rf /var/lib/nondum/* /var/lib/private/nondum/*")

    def status(self) -> View | None:
        """What `nondum status --json` shows; None while the daemon does not answer."""
        seen = self.machine.attempt("nondum status --json", timeout_s=PATIENCE_S)
        return json.loads(seen.out) if seen.status == 0 else None

    def until(self, what: str, look: Callable[[View], T | None]) -> T:
        """Look at the status until there is something to see."""

        def found() -> T | None:
            view = self.status()
            return look(view) if view is not None else None

        return self.machine.until(what, found, PATIENCE_S, LOOK_S)

    def bring(self, image: Path, payload: str, *, port: str | None = None) -> str:
        """Plug a stick in and wait until its payload is active; answers its name for `pull`.

        Drives that do not answer for ten seconds count as broken. Where the emulated processors
        have to wait that long for real ones, this does as people are told: pulls, and plugs again.
        """
        for attempt in range(REPLUGS):
            self.machine.replugs += attempt > 0
            stick = self.machine.plug(image, port=port)
            if self.until(f"{payload} or a stalled drive", partial(active_or_stalled, payload)):
                return stick
            self.machine.pull(stick)
            self.until("the stalled drive gone", none_stalled)
        raise AssertionError(f"the drive of {payload} stalled {REPLUGS} times")

    def components(self) -> list[View]:
        """What `nondum components --json` shows, peers' components too; nothing while the
        daemon does not answer."""
        seen = self.machine.attempt("nondum components --json", timeout_s=PATIENCE_S)
        rows: list[View] = seen.json() if seen.status == 0 else []
        return rows

    def until_component(self, component: str, state: str) -> View:
        """Wait until a component is in a state."""

        def found() -> View | None:
            states = [row for row in self.components() if row["component"] == component]
            return states[0] if states and states[0]["state"] == state else None

        return self.machine.until(f"{component} {state}", found, PATIENCE_S, LOOK_S)

    def until_peers(self, *wanted: str) -> None:
        """Wait until exactly these other hosts are here."""

        def found() -> bool | None:
            seen = self.machine.attempt("nondum peers --json", timeout_s=PATIENCE_S)
            if seen.status != 0:
                return None
            here = {row["peer"] for row in seen.json() if row["state"] == "here"}
            return True if here == {*wanted} else None

        what = f"{' and '.join(wanted) or 'no other host'} at {self.name}"
        self.machine.until(what, found, PATIENCE_S, LOOK_S)

    def until_goal(self, goal: str, state: str) -> View:
        """Wait until a goal, in PDDL, is in a state; one that is kept and true `holds`."""

        def found(view: View) -> View | None:
            rows = [row for row in view["goals"] if row["text"] == goal]
            holds = [row for row in rows if row["state"] == "active" and row["holds"]]
            wanted = holds if state == "holds" else [row for row in rows if row["state"] == state]
            return wanted[0] if wanted else None

        return self.until(f"{goal} {state}", found)

    def until_payload(self, payload: str, state: str) -> View:
        """Wait until a payload is in a state, or shown no more for the state `gone`."""

        return self.until(f"{payload} {state}", partial(_payload_in, payload, state))

    def _first_answer(self) -> View | None:
        if self.shown("NRestarts") != "0":
            raise AssertionError(f"{SERVICE} does not start\n{self.journal[-4000:]}")
        return self.status()

    def shown(self, name: str) -> str:
        """What systemd says of the service: see org.freedesktop.systemd1(5)."""
        return self.machine.run(f"systemctl show --value -p {name} {SERVICE}").strip()

    @property
    def journal(self) -> str:
        """What systemd's journal has of the service."""
        return self.machine.run(f"journalctl -o short-monotonic -u {SERVICE} --no-pager")


def _payload_in(payload: str, state: str, view: View) -> View | None:
    """The row of a payload that is in a state; an empty one of a payload that is gone."""
    rows = [row for row in view["payloads"] if row["payload"] == payload]
    if not rows:
        return {} if state == "gone" else None
    if rows[0]["state"] in ("refused", "quarantined") and state not in rows[0]["state"]:
        raise AssertionError(f"{payload} is {rows[0]['state']}: {rows[0]['problems']}")
    return rows[0] if rows[0]["state"] == state else None


def active_or_stalled(payload: str, view: View) -> bool | None:
    """Whether it is active; None while it is neither that nor kept from it by its drive."""
    if _payload_in(payload, "active", view):
        return True
    return None if none_stalled(view) else False


def none_stalled(view: View) -> bool | None:
    """True once no drive in the status has stalled; None while one has."""
    said = [problem for drive in view["drives"] for problem in drive["problems"]]
    return None if any(problem.startswith(STARVED) for problem in said) else True
