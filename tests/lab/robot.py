"""A host in a machine, met as the demonstrations meet theirs: their stages work with it."""

from __future__ import annotations

import io
import json
import shlex
import tarfile
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from demo.robot import Robot, View
from demo.stage import INSTALL_S
from tests.lab.agent import MachineSilent
from tests.lab.drives import fat_stick
from tests.lab.installed import PATIENCE_S, REPLUGS, Installed, active_or_stalled, none_stalled

LATEST = "/run/lab/view.json"
FOLLOW = f"""
import os, subprocess
follow = ["nondum", "status", "--follow", "--json"]
with subprocess.Popen(follow, stdout=subprocess.PIPE) as nondum:
    for line in nondum.stdout:
        with open("{LATEST}.part", "wb") as file:
            file.write(line)
        os.rename("{LATEST}.part", "{LATEST}")
"""
"""Keeps the latest view in a file: to start the command line takes a second of such a processor."""
FOLLOWER = "/run/lab/follow.py"
START_FOLLOWER = (
    f"systemd-run -q -p Restart=always -p RestartSec=1 -E PATH=$PATH python3 {FOLLOWER}"
)
LOOK_S = 1.0


class MachineRobot(Robot):
    """A host in a machine, once it has started. Its drives are sticks."""

    slowness = 20.0

    def __init__(self, host: Installed, payloads: Mapping[str, str]) -> None:
        """`payloads`: the name of each drive that will be plugged in → the payload that it has."""
        super().__init__(host.machine.work / "robot", name=host.name)
        self.work.mkdir()
        self.host, self.machine = host, host.machine
        self._payloads = payloads
        self._sticks: dict[str, str] = {}
        self.machine.put(FOLLOWER, FOLLOW)
        self.machine.run(START_FOLLOWER)

    # Drives

    def trust(self, file: Path) -> None:
        """Have it go by a trust file, its first one."""
        for name in (file.name, f"{file.name}.sig"):
            self.machine.put(f"/run/lab/{name}", file.with_name(name).read_bytes())
        self.nondum("keys", "trust", "--yes", f"/run/lab/{file.name}")

    def install(self, drive: Path) -> None:
        """Have its payload for good."""
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w") as archive:
            archive.add(drive, "drive")
        self.machine.put("/run/lab/drive.tar", packed.getvalue())
        self.machine.run("tar -C /run/lab -xf /run/lab/drive.tar --no-same-owner")
        self.nondum("payload", "install", "/run/lab/drive")
        self.machine.run("rm -r /run/lab/drive /run/lab/drive.tar")

    def plug(self, drive: Path) -> str:
        """Plug a stick in with what is in a folder, and wait until its payload is active; where the
        emulated processors had no time for it (see `Installed.bring`), plug it in again."""
        image = self.work / f"{drive.name}.img"
        if not image.exists():
            fat_stick(image, drive)
        payload = self._payloads[drive.name]
        for attempt in range(REPLUGS):
            self.machine.replugs += attempt > 0
            stick = self.machine.plug(image)
            active = f"{payload} active, or its drive stalled"
            if self.until(active, partial(_has_worked, payload), timeout_s=INSTALL_S) == "yes":
                self._sticks[drive.name] = stick
                return drive.name
            self.machine.pull(stick)
            self.until("the stalled drive gone", _is_gone, timeout_s=INSTALL_S)
        raise AssertionError(f"the drive of {payload} stalled {REPLUGS} times")

    def pull(self, name: str) -> None:
        """Yank a stick."""
        self.machine.pull(self._sticks.pop(name))

    @property
    def plugged(self) -> set[str]:
        """The names of the drives that are in."""
        return {*self._sticks}

    def payloads_on(self, drives: Collection[str], view: View | None = None) -> list[View]:
        """The rows of the payloads of these drives; machines number their drives themselves."""
        wanted = {self._payloads[name] for name in drives}
        rows = (self.view if view is None else view)["payloads"]
        return [row for row in rows if row["payload"] in wanted]

    # Words and files

    def nondum(self, *words: str) -> str:
        """Run the command line there, and return what it printed."""
        return self.machine.run(shlex.join(("nondum", *words)))

    def ask(self, verb: str, **arguments: Any) -> Any:
        """Ask by the command line that people have: `nondum VERB`."""
        named = [f"--limit={value}" for name, value in arguments.items() if name == "limit"]
        words = named or map(str, arguments.values())
        return json.loads(self.nondum(verb, *words, "--json"))

    def deliver(self, file: Path, folder: Path) -> None:
        """Copy a file into a folder of its machine, at once and whole."""
        unfinished = folder / f".{file.name}.part"
        self.machine.put(str(unfinished), file.read_bytes())
        self.machine.run(shlex.join(("mv", str(unfinished), str(folder / file.name))))

    def written(self, folder: Path, since_s: float) -> list[tuple[float, Path]]:
        """The files that were written to a folder there since a time of `now_s`, fetched."""
        listing = f"find {shlex.quote(str(folder))} -name '*.wav' -printf '%T@ %p\\n'"
        found = []
        for line in self.machine.run(listing).splitlines():
            stamp, _, path = line.partition(" ")
            if float(stamp) >= since_s:
                found.append((float(stamp), self._fetched(path)))
        return sorted(found)

    def now_s(self) -> float:
        """Seconds since 1970, by its own clock."""
        return float(self.machine.run("date +%s.%N"))

    # What is seen of it

    def shown(self) -> Iterator[View]:
        """What is to be seen, until the machine is silent."""
        seen = ""
        with suppress(MachineSilent):
            while True:
                latest = self.machine.agent.run("cat", LATEST, timeout_s=PATIENCE_S)
                if latest.status == 0 and latest.out != seen:
                    seen = latest.out
                    yield json.loads(seen)
                time.sleep(LOOK_S)

    def _fetched(self, path: str) -> Path:
        local = self.work / Path(path).name
        if not local.exists():
            local.write_bytes(self.machine.get(path))
        return local


def _has_worked(payload: str, view: View) -> str | None:
    """`yes` or `no` as soon as it is known."""
    return {True: "yes", False: "no", None: None}[active_or_stalled(payload, dict(view))]


def _is_gone(view: Mapping[str, Any]) -> bool | None:
    return none_stalled(dict(view))
