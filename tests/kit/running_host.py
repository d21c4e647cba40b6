"""A whole host under test: a daemon in a separate process, used only as people use it.

Everything is done through its control socket, its command line, its slots and its ports; what it
leaves behind is looked for in /proc and on disk.
"""

from __future__ import annotations

import dataclasses
import os
import select
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from demo.robot import NONDUM, Robot, TooLate, View, configuration
from tests.kit import evidence
from tests.kit.command_line import Ran, clean_environment, command, nondum
from tests.kit.fork_server import Forked, fork_server, module_of
from tests.kit.payloads import Part, make_payload
from tests.kit.traces import Traces, former_payloads
from tests.kit.until import PATIENCE_S

from nondum.sdk.errors import NondumError

READY_S = PATIENCE_S
END_S = PATIENCE_S
DAEMON = (*NONDUM, "host", "run", "--user")
"""Forked from a process that has imported it."""
COMMAND = (str(Path(sys.executable).with_name("nondum")), "host", "run", "--user")
"""What people type, with the whole start of Python."""

Row = View
"""A line of a table, as JSON has it."""


class RunningHost(Robot):
    """One daemon after the other on one state folder; every view that it showed is kept."""

    def __init__(
        self,
        work: Path,
        *,
        name: str = "spot",
        trust: Path | None = None,
        more: str = "",
        program: Sequence[str] = DAEMON,
    ) -> None:
        """`trust` is the trust file that it goes by, which need not be there yet; without one, it
        takes any payload. `more` are further lines of its configuration; `program` runs a daemon,
        in a process of the fork server if it is `python -m …`."""
        super().__init__(work, name=name)
        self.state = work / "state"
        self.views: list[View] = []
        """All that it showed, oldest first, since the daemon was started or `forget`."""
        self._known = Known()
        self.release = 1
        """Release of the payloads that `drive` writes."""
        self._program = program
        self._daemon: subprocess.Popen[bytes] | Forked | None = None
        self._threads: list[threading.Thread] = []
        for folder in (self.slots, self.devices):
            folder.mkdir(parents=True)
        self.config.write_text(configuration(self, trust) + more, encoding="utf-8")

    # The daemon's life

    def start(self) -> None:
        """Start a daemon and wait until it listens. Raises `TooLate` with its last words."""
        listens = threading.Event()
        program = (*self._program, "--config", str(self.config))
        evidence.keep(self)
        if module := module_of(program):
            self._daemon = fork_server().start(module, stderr=subprocess.PIPE)
        else:
            self._daemon = subprocess.Popen(program, stderr=subprocess.PIPE)
        self._view, self.views, self._watching = {}, [], True
        self._known = replace(self._known, told=0, goals=frozenset())
        self._begin(self._keep_log, listens)
        if not listens.wait(READY_S) or self._daemon.poll() is not None:
            raise TooLate(f"the daemon does not listen:\n{evidence.logged(self.log_file)}")
        self._begin(self.watch)
        self.until("a first view", lambda view: view, timeout_s=READY_S)

    def kill(self) -> None:
        """SIGKILL the daemon."""
        assert self._daemon is not None, "it was never started"
        self._daemon.kill()
        self._see_end()

    def stop(self, number: int = signal.SIGTERM) -> int | None:
        """Stop the daemon by a signal, as an operator does, if it runs; returns its status."""
        if self._daemon is None:
            return None
        self._daemon.send_signal(number)
        return self._see_end()

    @property
    def pid(self) -> int:
        """The daemon's process."""
        assert self._daemon is not None, "it was never started"
        return self._daemon.pid

    @property
    def runs(self) -> bool:
        """Whether a daemon was started and has neither been stopped nor killed here."""
        return self._daemon is not None

    @property
    def config(self) -> Path:
        """Its configuration file."""
        return self.work / "host.toml"

    @property
    def log_file(self) -> Path:
        """Where all that the daemons write is kept."""
        return self.work / "daemon.log"

    @property
    def log(self) -> str:
        """What the daemons wrote."""
        return self.log_file.read_text(encoding="utf-8") if self.log_file.exists() else ""

    def see(self, view: View) -> None:
        """Take in a newer view, and keep it."""
        self.views.append(view)
        super().see(view)

    # What people do

    def drive(self, name: str, *parts: Part, **options: Any) -> Path:
        """Write a drive with one payload, `org.example.<name>`.

        After `forget` it is a newer release than before: one release has one content.
        """
        drive = self.work / "drives" / name
        options = {"release": self.release} | options
        make_payload(drive, *parts, payload_id=f"org.example.{name}", **options)
        return drive

    def bring(self, name: str, *parts: Part, **options: Any) -> Path:
        """Write a drive, plug it in and wait until its payload is active."""
        drive = self.drive(name, *parts, **options)
        self.plug(drive)
        self.until_step(name, "active")
        return drive

    def want(self, pddl: str, kind: str = "maintain") -> str:
        """Give a goal; returns its id."""
        return str(self.ask("goal", pddl=pddl, kind=kind)["id"])

    def run(self, *arguments: str | Path, **environment: str) -> Ran:
        """Run the command line for this host."""
        return nondum("--control", self.control, *arguments, **environment)

    @contextmanager
    def started(self, *arguments: str | Path) -> Iterator[subprocess.Popen[str]]:
        """Run the command line for this host for as long as the context lasts."""
        process = subprocess.Popen(
            command("--control", self.control, *arguments),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=clean_environment() | {"PYTHONUNBUFFERED": "1"},
        )
        with process:
            try:
                yield process
            finally:
                process.kill()

    # What people see

    def components(self) -> list[Row]:
        """All components when they are asked for, but for their ages."""
        return [_ageless(row) for row in self.ask("components")]

    def component(self, id: str) -> Row | None:
        """A component as it is shown now, but for its age."""
        row = _one(self.view["components"], "component", id)
        return row and _ageless(row)

    def payload(self, name: str) -> Row | None:
        """A payload of a drive that `drive` wrote, as it is shown now."""
        return payload(self.view, name)

    def until_step(self, name: str, *steps: str) -> Row:
        """Wait until a payload is at one of some steps."""

        def found(view: View) -> Row | None:
            row = payload(view, name)
            if row is None or row["state"] in steps:
                return row
            assert row["state"] not in ("refused", "quarantined"), row["problems"]
            return None

        return self.until(f"{name}: {' or '.join(steps)}", found, timeout_s=READY_S)

    def until_gone(self, name: str) -> None:
        """Wait until a payload is not shown any more."""
        self.until(f"{name}: gone", lambda v: payload(v, name) is None, timeout_s=READY_S)

    def until_component(self, id: str, state: str) -> Row:
        """Wait until a component is in a state; without its age."""

        def found(view: View) -> Row | None:
            row = _one(view["components"], "component", id)
            return _ageless(row) if row is not None and row["state"] == state else None

        return self.until(f"{id}: {state}", found, timeout_s=READY_S)

    def until_goal(self, id: str, *states: str) -> Row:
        """Wait until a goal is in one of some states; an active one that is true `holds`. A state
        that others follow by themselves may be over before it is shown."""

        def found(view: View) -> Row | None:
            row = goal(view, id)
            if row is None:
                return None
            is_kept = row["state"] == "active" and row["holds"]
            return row if ("holds" if is_kept else row["state"]) in states else None

        return self.until(f"goal {id}: {' or '.join(states)}", found, timeout_s=READY_S)

    def until_told(self, words: str, *, since: int = 0) -> str:
        """Wait for a sentence with these words in it, told since `forget`."""
        after = max(since, self._known.told)

        def found(view: View) -> str | None:
            told = (row["text"] for row in view["told"] if row["number"] > after)
            return next((text for text in told if words in text), None)

        return self.until(f"told: {words}", found, timeout_s=READY_S)

    def until_runs(self, behaviour: str) -> Row:
        """Wait until a step of the plan that is called so is established."""

        def found(view: View) -> Row | None:
            rows = (r for r in view["plan"]["steps"] if r["state"] == "established")
            return next((row for row in rows if f".{behaviour} " in row["action"]), None)

        return self.until(f"{behaviour}: established", found, timeout_s=READY_S)

    def facts(self) -> dict[str, Any]:
        """What is believed now: fact → value."""
        return {row["fact"]: row["value"] for row in self.ask("facts")}

    def journal(self, subject: str | None = None) -> list[Row]:
        """What happened since `forget`, oldest first."""
        rows = self.ask("journal", subject=subject, limit=10_000)
        return [row for row in rows if row["id"] > self._known.journal]

    def goals(self) -> list[Row]:
        """The goals as they are shown now, but for those that ended before `forget`."""
        return [row for row in self.view["goals"] if row["id"] not in self._known.goals]

    def traces(self) -> Traces:
        """All that payloads have on this machine through this host."""
        return Traces.of(self.state, self.work / "drives")

    # Between tests

    def clear(self) -> None:
        """Halt everything, pull all drives and devices, and have what was here forgotten.

        Raises `TooLate` if something stays.
        """
        self.ask("halt", now=True)
        for folder in (self.slots, self.devices):
            for slot in folder.iterdir():
                slot.unlink()
        self.until("nothing is left", has_nothing, timeout_s=READY_S)
        for payload_id in former_payloads(self.state):
            self.ask("forget", payload=payload_id)
        shutil.rmtree(self.work / "drives", ignore_errors=True)

    def forget(self) -> None:
        """Show from now on what is told, done and asked for from now on, as if it began here."""
        goals = frozenset(row["id"] for row in self.view["goals"])
        journal = self.ask("journal", limit=1)
        self._known = Known(self.told_number(), journal[-1]["id"] if journal else 0, goals)
        self.release += 1
        self.views = [self.view]

    def holdings(self) -> dict[str, Any]:
        """All that a test may leave behind: what it believes, warns of, has and keeps."""
        names = ("components", "units", "streams", "devices")
        found = {name: self.ask(name) for name in names}
        found["peers"] = self.peers()
        found["warnings"] = frozenset(self.ask("status")["warnings"])
        found["facts"] = self.facts().keys() - {f"self {self.name}"}  # that comes by itself
        traces = dataclasses.asdict(self.traces())
        traces["rows"] = [row for row in traces["rows"] if row[0] != "known_devices"]
        return found | traces

    def peers(self) -> list[str]:
        """The hosts that are its peers now, if it may have any."""
        try:
            rows = self.ask("peers")
        except NondumError as error:
            assert error.code == "PEERS_OFF", error
            return []
        return sorted(row["peer"] for row in rows if row["state"] == "here")

    # Inside

    def _last_words(self) -> str:
        return f"{super()._last_words()}\n{evidence.logged(self.log_file)}"

    def _begin(self, work: Any, *arguments: Any) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _keep_log(self, listens: threading.Event) -> None:
        assert self._daemon is not None
        assert self._daemon.stderr is not None
        with self._daemon.stderr as lines, self.log_file.open("ab") as log:
            for line in lines:
                log.write(line)
                log.flush()
                if b" listens at " in line:
                    listens.set()
        listens.set()

    def _see_end(self) -> int:
        assert self._daemon is not None
        status = self._daemon.wait(END_S)
        while self._threads:
            self._threads.pop().join(END_S)
        self._daemon = None
        return status


@dataclass(frozen=True)
class Known:
    """What a host said before `forget`, of which it is not asked again."""

    told: int = 0
    """Number of the last sentence."""
    journal: int = 0
    """Number of the last entry."""
    goals: frozenset[str] = frozenset()


def has_nothing(view: View) -> bool:
    """Whether a host has nothing plugged in, and nothing to do."""
    own = [row for row in view["components"] if "@" not in row["component"]]
    open_goals = [row for row in view["goals"] if row["state"] not in ("halted", "reached")]
    running = view["plan"].get("steps")
    return not any((view["drives"], view["payloads"], own, open_goals, running))


@contextmanager
def running(work: Path, **options: Any) -> Iterator[RunningHost]:
    """A host that runs, and that ends well when it is stopped at last, if it runs still."""
    host = RunningHost(work, **options)
    try:
        host.start()
        yield host
    finally:
        status = host.stop()
    assert status in (None, 0), host.log
    assert "Traceback" not in host.log, host.log


def payload(view: View, name: str) -> Row | None:
    """A payload of a drive that `RunningHost.drive` wrote."""
    return _one(view["payloads"], "payload", f"org.example.{name}")


def goal(view: View, id: str) -> Row | None:
    """A goal by its id; one that was just given may not be shown yet."""
    return _one(view["goals"], "id", id)


def steps(view: View) -> dict[str, str]:
    """Action → state, of the plan at hand."""
    return {row["action"]: row["state"] for row in view["plan"]["steps"]}


def happened(journal: Sequence[Row], *wanted: tuple[str, str]) -> bool:
    """Whether these (event, subject) stand in a journal in this order, whatever is between."""
    rows = iter([(row["event"], row["subject"]) for row in journal])
    return all(want in rows for want in wanted)


def until_ended(pid: int, timeout_s: float = END_S) -> None:
    """Wait for a process to end, whosever child it is. Raises `TooLate`."""
    try:
        descriptor = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    try:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        if not poll.poll(timeout_s * 1000):
            raise TooLate(f"process {pid} still runs after {timeout_s:.0f} s")
    finally:
        os.close(descriptor)


def _one(rows: Sequence[Row], key: str, value: str) -> Row | None:
    return next((row for row in rows if row[key] == value), None)


def _ageless(row: Row) -> Row:
    """Without what is another at each look, or in each process."""
    return {key: value for key, value in row.items() if key not in ("age_s", "since")}
