"""A real daemon with its own state and slots, and the command line run against it."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.kit import evidence
from tests.kit.fork_server import Forked, fork_server, module_of
from tests.kit.payloads import Part, make_payload
from tests.kit.until import PATIENCE_S, until

from nondum.host.control.client import ControlClient

HOST = "panther"

BEACON = '''"""A light that shines for people and greets them."""

from nondum.sdk import Fragment, Header, Label, Output, Phrase, Scalar, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain beacon)
  (:predicates (lit ?h - host) (greeted ?c - class ?h - host))
  (:action shine
    :parameters (?u - light ?o - scalar ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (lit ?h)))
  (:action greet
    :parameters (?u - light ?c - class ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (lit ?h))
    :effect (greeted ?c ?h)))
"""
PROBLEM = "(define (problem beacon) (:domain beacon) (:objects person - class))"

@hookimpl
def units():
    return [Unit("lamp", "light", outputs=(Output("brightness", "scalar"),))]

@hookimpl
def fragments():
    return [Fragment("domain.pddl", DOMAIN), Fragment("problem.pddl", PROBLEM)]

@hookimpl
def phrases():
    return [Phrase("shine [for {words:text}]", "(lit self)", kind="maintain")]

@hookimpl
def labels():
    return [Label("person", "people")]

@hookimpl
def start(ctx):
    ctx.log.info("polished")
    print("plain words")

@behaviour("shine", action="(shine ?u - light ?o - scalar ?h - host)", lasting=True)
async def shine(ctx, u, o, h):
    """Shine until halted."""
    await ctx.established()
    seq = 0
    while True:
        seq += 1
        ctx.output(o).send(Scalar(Header(frame_id=u, seq=seq), 0.5, "1"))
        await ctx.sleep(0.01)

@behaviour(
    "greet", action="(greet ?u - light ?c - class ?h - host)", phrase="greet {c}"
)
async def greet(ctx, u, c, h):
    """Greet once."""
    ctx.know("greeted", c, h)
'''
BEACON_ID = "org.example.beacon"
LAMP = f"{HOST}__beacon__lamp"
BRIGHTNESS = f"{HOST}__beacon__brightness"


@dataclass(frozen=True)
class Ran:
    """What one run of the command line came to."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Standard output, parsed."""
        return json.loads(self.out)

    def ok(self) -> Ran:
        """This, if the command did what it was asked for."""
        assert self.code == 0, (self.code, self.out, self.err)
        assert not self.err, self.err
        return self

    def refused(self, code: int, words: str) -> Ran:
        """This, if the command refused with that exit code and those words, without a traceback."""
        assert "Traceback" not in self.err, self.err
        assert self.code == code, (self.code, self.out, self.err)
        assert words in self.err, self.err
        return self


@dataclass(frozen=True)
class Daemon:
    """One host, running."""

    root: Path
    process: subprocess.Popen[str] | Forked

    name = HOST

    @property
    def runs(self) -> bool:
        return self.process.poll() is None

    @property
    def log_file(self) -> Path:
        """Where what it writes is kept, if `running` or `killed` has started it."""
        return self.root / "daemon.log"

    @property
    def log(self) -> str:
        return self.log_file.read_text(encoding="utf-8")

    @property
    def listens(self) -> bool:
        """Whether it has said so."""
        return "listens at" in self.log

    @property
    def control(self) -> Path:
        return self.root / "control.sock"

    @property
    def slots(self) -> Path:
        return self.root / "slots"

    def plug(self, payload_id: str, *parts: Part, **options: Any) -> Path:
        """Make a drive with one payload and put it into a slot."""
        drive = self.root / "drives" / payload_id
        make_payload(drive, *parts, payload_id=payload_id, **options)
        (self.slots / payload_id).symlink_to(drive)
        return drive

    def pull(self, payload_id: str) -> None:
        """Take a drive out."""
        (self.slots / payload_id).unlink()

    def until(self, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Wait until the host looks like that, and give that look."""
        view: dict[str, Any] = {}
        with ControlClient(self.control, timeout_s=PATIENCE_S) as client:
            for view in client.follow("watch"):
                if holds(view):
                    break
        return view

    def until_state(self, payload_id: str, state: str) -> dict[str, Any]:
        """Wait until a payload is in a state, and give its row."""

        def rows(view: dict[str, Any]) -> list[dict[str, Any]]:
            return [row for row in view["payloads"] if row["payload"] == payload_id]

        view = self.until(lambda view: any(row["state"] == state for row in rows(view)))
        return rows(view)[0]

    def run(self, *arguments: str | Path, **environment: str) -> Ran:
        """Run `nondum` against this host."""
        return nondum("--control", self.control, *arguments, **environment)

    @contextmanager
    def started(self, *arguments: str | Path) -> Iterator[subprocess.Popen[str]]:
        """Run `nondum` against this host for as long as the context lasts."""
        process = subprocess.Popen(
            command("--control", self.control, *arguments),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=quiet_environment() | {"PYTHONUNBUFFERED": "1"},
        )
        with process:
            try:
                yield process
            finally:
                process.kill()


def nondum(*arguments: str | Path, **environment: str) -> Ran:
    """Run `nondum` as a process of its own."""
    done = subprocess.run(
        command(*arguments),
        capture_output=True,
        text=True,
        env=quiet_environment() | environment,
        timeout=PATIENCE_S,
        check=False,
    )
    return Ran(done.returncode, done.stdout, done.stderr)


def in_terminal(*arguments: str | Path, **environment: str) -> str:
    """Run `nondum` in a terminal, and give everything that it shows there."""
    code, shown = at_terminal(*arguments, typed="", environment=environment)
    assert code == 0, shown
    return shown


def at_terminal(
    *arguments: str | Path, typed: str, environment: Mapping[str, str] | None = None
) -> tuple[int, str]:
    """Run `nondum` in a terminal where a person types; give its code and all that it shows."""
    ours, theirs = pty.openpty()
    os.write(ours, typed.encode())
    process = subprocess.Popen(
        command(*arguments),
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=quiet_environment() | {"TERM": "xterm"} | dict(environment or {}),
    )
    os.close(theirs)
    shown = b""
    with process:
        while some := _read(ours):
            shown += some
    os.close(ours)
    return process.returncode, shown.decode()


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 65536)
    except OSError:  # how Linux tells that nobody has the other end open
        return b""


def command(*arguments: str | Path) -> list[str]:
    """The command line that runs `nondum`."""
    return [sys.executable, "-m", "nondum.host.cli", *map(str, arguments)]


def quiet_environment() -> dict[str, str]:
    """This process's environment, less what would change what is printed, or who answers."""
    changing = {"NONDUM_CONTROL", "COLUMNS", "NO_COLOR", "FORCE_COLOR"}
    return {key: value for key, value in os.environ.items() if key not in changing}


def write_config(root: Path, more: str = "", *, allow_unsigned: bool = True) -> Path:
    """A host that needs nothing of the machine."""
    root.mkdir(parents=True, exist_ok=True)
    for folder in ("slots", "devices"):
        (root / folder).mkdir(exist_ok=True)
    config = root / "host.toml"
    config.write_text(
        f'[host]\nname = "{HOST}"\nstate = "{root}/state"\ncontrol = "{root}/control.sock"\n'
        f'[drives]\nslots = ["{root}/slots"]\nallow_unsigned = {str(allow_unsigned).lower()}\n'
        f'[devices]\nslots = ["{root}/devices"]\nudev = false\n{more}',
        encoding="utf-8",
    )
    return config


@contextmanager
def running(
    root: Path, more: str = "", *, allow_unsigned: bool = True, is_forked: bool = True
) -> Iterator[Daemon]:
    """Run a daemon; it must end well when it is told to."""
    with killed(root, more, allow_unsigned=allow_unsigned, is_forked=is_forked) as daemon:
        yield daemon
        daemon.process.terminate()
        assert daemon.process.wait(PATIENCE_S) == 0, daemon.log
        assert "Traceback" not in daemon.log, daemon.log


@contextmanager
def killed(
    root: Path, more: str = "", *, allow_unsigned: bool = True, is_forked: bool = True
) -> Iterator[Daemon]:
    """Run a daemon, `more` in its configuration, and end it without a warning (SIGKILL).

    One that is not forked is executed: only then does the dynamic linker see the environment.
    """
    config = write_config(root, more, allow_unsigned=allow_unsigned)
    program = command("host", "run", "--user", "--config", config)
    with (root / "daemon.log").open("wb") as log:
        daemon = Daemon(root, _started(program, log.fileno(), is_forked=is_forked))
    evidence.keep(daemon)
    try:
        until("a daemon that listens", lambda: daemon.listens or not daemon.runs)
        yield daemon
    finally:
        daemon.process.kill()
        daemon.process.wait(PATIENCE_S)


def _started(program: list[str], log: int, *, is_forked: bool) -> subprocess.Popen[str] | Forked:
    if is_forked and (module := module_of(program)) is not None:
        return fork_server().start(module, stderr=log)
    return subprocess.Popen(program, stderr=log, text=True, env=quiet_environment())
