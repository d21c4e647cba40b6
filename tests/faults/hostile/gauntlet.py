"""All hostile drives through one daemon's life, beside payloads that must work on undisturbed."""

from __future__ import annotations

import hashlib
import re
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.daemon.plugins import scribe, talker
from tests.faults.footprint import Footprint
from tests.faults.hostile.case import Bench, HostileDrive
from tests.faults.hostile.signing import MAKER, sign, trust
from tests.kit.loop_devices import attach, detach
from tests.kit.payloads import Part
from tests.kit.running_host import Row, RunningHost
from tests.kit.signing import sign_payload
from tests.kit.traces import Traces
from tests.kit.until import until

from nondum.sdk.errors import Problem

HEALTHY = ("talker", "scribe")
GOAL = "(written spot)"
JUDGED_S = 60.0
PRUNED_S = 20.0
OVER = ("refused", "quarantined", "active")
MOST_ROWS = 100
"""Of the journal on one drive."""
REMEDY = "→ "
"""Stands before what to do, in each problem that is told."""
CONTROLS = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]")
"""What a terminal would do something with, but for line ends and tabs."""
MORE = "[workers]\nstartup_s = 30.0\n"


@dataclass(frozen=True)
class Plugged:
    """A drive on its way through the daemon."""

    case: HostileDrive
    folder: Path
    node: Path | None = None

    @property
    def is_block(self) -> bool:
        """Whether it is a block device."""
        return self.node is not None

    def fingerprint(self) -> str:
        """Another one when a byte, a name or a moment of it is another."""
        if self.case.is_image:
            return hashlib.sha256(self.folder.with_suffix(".img").read_bytes()).hexdigest()
        digest = hashlib.sha256()
        for path in sorted(self.folder.rglob("*")):
            found = path.lstat()
            seen = (bytes(path), found.st_mode, found.st_size, found.st_mtime_ns)
            digest.update(repr(seen).encode())
        return digest.hexdigest()

    def is_called(self, drive: str) -> bool:
        """Whether the daemon means this one."""
        if self.node is not None:
            name, node = drive.split("-")[0], self.node.name
            return name == node or name.startswith(f"{node}p")
        return drive == self.folder.name


@dataclass
class Outcome:
    """What it came to."""

    drives: int = 0
    wrong: list[str] = field(default_factory=list)
    """Drives that were told with another code, and with which."""
    without_remedy: list[str] = field(default_factory=list)
    """Drives that were refused without a word of what to do."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Drive → from plugging in until told, of those that were plugged in alone."""
    pids: set[int] = field(default_factory=set)
    footprints: list[Footprint] = field(default_factory=list)
    """Of the daemon, at rest: before, and after each round."""
    canaries: int = 0
    strays: list[str] = field(default_factory=list)
    """What lies outside the state folder and was not there before."""
    touched: list[str] = field(default_factory=list)
    """Drives that are not as they were made."""
    controls: int = 0
    """Bytes in the log that a terminal would obey."""


class Gauntlet:
    """One daemon. Made by `gauntlet`."""

    def __init__(self, host: RunningHost, work: Path, elsewhere: Sequence[Path]) -> None:
        self.host, self.outcome = host, Outcome()
        self._work, self._elsewhere = work, elsewhere
        self._canary = work / "canary"
        self._goal = ""
        self._healthy: list[Row] = []
        self._traces: Traces | None = None
        self._made: dict[str, str] = {}
        """Drive → what it was made as."""
        self._last_row: dict[str, int] = {}
        """Drive → the last entry of the journal that was read on it."""

    def begin(self) -> None:
        """Have the benign payloads at work."""
        for name, part in (("talk", talker()), ("write", scribe())):
            self._bring(name, part)
        self._goal = self.host.want(GOAL)
        self.host.until_goal(self._goal, "holds")
        self._healthy = self._at_work()
        # The first drive has spare processes made, which stay.
        self.host.plug(self.host.drive("first"))
        self.host.until_told("SIG_MISSING")
        self.host.pull("first")
        self.host.until_gone("first")
        self._traces = self.host.traces()

    def make(self, cases: Sequence[HostileDrive]) -> list[Plugged]:
        """Write the drives, once. What is wrong with each is found although it is signed."""
        made = []
        for number, case in enumerate(cases, start=len(self._made)):
            drive = self._work / f"h{number}"
            drive.mkdir()
            case.make(Bench(drive, number, self._canary, sign))
            made.append(Plugged(case, drive))
            self._made[case.name] = made[-1].fingerprint()
        return made

    def round(self, drives: Sequence[Plugged], *, at_once: int) -> None:
        """Send every drive through, some at a time; alone, it is timed."""
        for first in range(0, len(drives), at_once):
            began = time.monotonic()
            batch = [self._plug(drive) for drive in drives[first : first + at_once]]
            told = [self._judged(drive) for drive in batch]
            if at_once == 1:
                self.outcome.seconds[batch[0].case.name] = time.monotonic() - began
            for drive, (problems, active) in zip(batch, told, strict=True):
                self._judge(drive.case, problems, active)
            for drive in batch:
                self._pull(drive)
            for drive in batch:
                self._gone(drive)
            self._check_healthy()
            self.host.views.clear()  # each is big, and none is needed
        self.outcome.touched = [d.case.name for d in drives if not self._is_as_made(d)]
        self.outcome.controls = len(CONTROLS.findall((self.host.work / "daemon.log").read_bytes()))
        until(
            "nothing left of the drives",
            lambda: not self._stayed(),
            evidence=self._stayed,
            patience_s=PRUNED_S,
        )

    def _bring(self, name: str, part: Part) -> None:
        """Have a benign payload at work, signed with a key that the host trusts."""
        drive = self.host.drive(name, part)
        sign_payload(drive / "nondum" / f"org.example.{name}", MAKER)
        self.host.plug(drive)
        self.host.until_step(name, "active")

    def _plug(self, drive: Plugged) -> Plugged:
        if not drive.case.is_image:
            self.host.plug(drive.folder)
            return drive
        image = drive.folder.with_suffix(".img")
        return Plugged(drive.case, drive.folder, attach(image))

    def _pull(self, drive: Plugged) -> None:
        if drive.node is None:
            self.host.pull(drive.folder.name)
        else:
            detach(drive.node)

    def _judge(self, case: HostileDrive, problems: Sequence[str], active: int) -> None:
        """Note whether it was told what it should be, and let in what it should have."""
        codes = [problem.split(" ")[0] for problem in problems]
        self.outcome.drives += 1
        if not case.is_right(codes, active):
            told = ", ".join(codes) or "nothing"
            self.outcome.wrong.append(f"{case.name}: {told}, {active} active")
        if not all(REMEDY in problem for problem in problems):
            self.outcome.without_remedy.append(case.name)

    def _is_as_made(self, drive: Plugged) -> bool:
        return drive.fingerprint() == self._made[drive.case.name]

    def _judged(self, drive: Plugged) -> tuple[tuple[str, ...], int]:
        """The problems that it is told with, once there is nothing more to be told, and how many
        of its payloads are active."""

        def found(view: Row) -> tuple[tuple[str, ...], int] | None:
            rows = [row for row in view["drives"] if drive.is_called(row["drive"])]
            if not rows or any(row["state"] != "idle" for row in rows):
                return None
            names = {row["drive"] for row in rows}
            payloads = [p for p in view["payloads"] if names & set(p["drive"].split(", "))]
            if any(row["state"] not in OVER for row in payloads):
                return None
            problems = [problem for row in (*rows, *payloads) for problem in row["problems"]]
            active = sum(row["state"] == "active" for row in payloads)
            return (tuple(problems), active) if problems or payloads else None

        problems, active = self.host.until(f"{drive.case.name} judged", found, timeout_s=JUDGED_S)
        return (*problems, *self._told_of_trust(drive)), active

    def _told_of_trust(self, drive: Plugged) -> list[str]:
        """The problems of trust files that it brought: the drive and its payloads have none.

        They come before what its payloads come to. They are read from the journal: a view has the
        last 50 sentences, and many drives at once make more than that before the next view.
        """
        name = drive.folder.name
        rows = self.host.ask("journal", subject=name, limit=MOST_ROWS)
        news = [row for row in rows if row["id"] > self._last_row.get(name, 0)]
        self._last_row[name] = max((row["id"] for row in rows), default=0)
        refused = [row for row in news if row["event"] == "TrustFileRefused"]
        return [str(Problem(**problem)) for row in refused for problem in row["problems"]]

    def _gone(self, drive: Plugged) -> None:
        def is_gone(view: Row) -> bool:
            there = [row["drive"] for row in (*view["drives"], *view["payloads"])]
            return not any(drive.is_called(name) for names in there for name in names.split(", "))

        self.host.until(f"{drive.case.name} gone", is_gone, timeout_s=JUDGED_S)

    def _check_healthy(self) -> None:
        """Healthy components work on, and nothing ran that should not."""
        assert self._at_work() == self._healthy
        self.host.until_goal(self._goal, "holds")
        self.outcome.canaries += self._canary.exists()

    def _stayed(self) -> list[str]:
        """What drives that are gone have left on this machine."""
        assert self._traces is not None
        before, now = self._traces, self.host.traces()
        return [
            f"{name}: {trace}"
            for name in ("workers", "opened", "mounts", "folders", "rows")
            for trace in getattr(now, name)
            if trace not in getattr(before, name)
        ]

    def _at_work(self) -> list[Row]:
        rows = (row for row in self.host.ask("components") if row["component"] in HEALTHY)
        return [{key: value for key, value in row.items() if key != "age_s"} for row in rows]

    def measure(self) -> None:
        """Note what the daemon takes when it is at rest."""
        self.outcome.pids.add(self.host.pid)
        self.outcome.footprints.append(Footprint.of(self.host.pid, self.host.state))
        self.outcome.strays = [str(p) for folder in self._elsewhere for p in folder.iterdir()]


@contextmanager
def gauntlet(root: Path) -> Iterator[Gauntlet]:
    """A daemon with benign payloads at work, whose home and temporary folder are empty ones."""
    work = root / "drives"
    elsewhere = [root / name for name in ("home", "tmp", "config")]
    for folder in (work, *elsewhere):
        folder.mkdir(parents=True)
    home, temporary, config = elsewhere
    surroundings = (f"HOME={home}", f"TMPDIR={temporary}", f"XDG_CONFIG_HOME={config}")
    daemon = (sys.executable, "-m", "tests.daemon.loop_daemon", str(work))
    program = ("env", *surroundings, *daemon)
    anchor = root / "trust.toml"
    anchor.write_text(trust())
    more = f'{MORE}[trust]\nfile = "{anchor}"\n'
    host = RunningHost(root / "host", more=more, program=program)
    demand_signatures(root / "host/host.toml")
    try:
        host.start()
        run = Gauntlet(host, work, elsewhere)
        run.begin()
        yield run
    finally:
        host.stop()


def demand_signatures(config: Path) -> None:
    """What the service has by default, and demonstrations have not."""
    text = config.read_text(encoding="utf-8")
    config.write_text(text.replace("allow_unsigned = true", "allow_unsigned = false"))
