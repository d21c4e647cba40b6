"""Makes the files beside it again: those of the version before. See README.md.

    python tests/data/version_before/make.py CHECKOUT

CHECKOUT is one of commit 9db550b, with an environment in `.venv` (`./run setup`) that runs it. It
is not changed. pip fetches hatchling, msgpack and pluggy.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
WORK = Path("/var/tmp/nondum-version-before")
"""Where the daemon of the version before ran: its catalogue has paths in it."""
DEBIANS = "/usr/bin"
"""Where Python is on Debian."""
PATIENCE_S = 60.0
MSGPACK = "msgpack==1.1.2"
HOST = """\
[host]
name = "{name}"
state = "{work}/state"
control = "{work}/control.sock"
[drives]
slots = ["{work}/slots"]
block_devices = false
allow_unsigned = true
[devices]
slots = ["{work}/device-slots"]
udev = false
[workers]
confinement = "0"
minimum_confinement = 0
"""
PEERS = """\
[peers]
enabled = true
development = true
discover = false
listen = ["tcp://127.0.0.1:{port}"]
static = {static}
"""
GREETINGS = ("9700", "9701")
"""How a hello and a welcome begin: lists of seven fields."""
PORTS = {"before": 47410, "other": 47411}


class Checkout:
    """The version before, by its commands."""

    def __init__(self, root: Path) -> None:
        self.root, self.python = root, str(root / ".venv/bin/python")
        self.environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1"}

    def run(self, *arguments: str | Path, **environment: str) -> str:
        """Run a Python program; what it prints."""
        command = [self.python, *map(str, arguments)]
        done = subprocess.run(
            command,
            check=True,
            stdout=subprocess.PIPE,
            text=True,
            env=self.environment | environment,
        )
        return done.stdout

    def nondum(self, *arguments: str | Path) -> Any:
        """Run the command line; what it prints as JSON."""
        return json.loads(self.run("-m", "nondum.host.cli", *arguments, "--json"))

    @contextlib.contextmanager
    def daemon(self, work: Path, name: str, more: str = "", *program: str) -> Iterator[None]:
        """Run a daemon whose files are below `work`, and stop it as an operator does."""
        for folder in ("slots", "device-slots"):
            (work / folder).mkdir(parents=True, exist_ok=True)
        config = work / "host.toml"
        config.write_text(HOST.format(name=name, work=work) + more, encoding="utf-8")
        command = [self.python, *(program or ("-m", "nondum.host.cli"))]
        command += ["host", "run", "--user", "--config", str(config)]
        with subprocess.Popen(command, env=self.environment) as process:
            try:
                until((work / "control.sock").exists)
                yield
            finally:
                process.send_signal(signal.SIGTERM)


def until(holds: Any) -> None:
    """Wait until something holds."""
    end_s = time.monotonic() + PATIENCE_S
    while not holds():
        if time.monotonic() > end_s:
            raise SystemExit("it takes too long")
        time.sleep(0.2)


def runtime_wheels(before: Checkout, folder: Path) -> None:
    """What a payload needs at run time: for any machine, and stored without compression, so that
    the drive and what a store unpacks of it are compressed together."""
    made = folder / "made"
    pip = ("-m", "pip", "wheel", "-q", "--no-deps", "-w", made)
    copy = shutil.copytree(before.root / "plugins/sdk", folder / "sdk")
    before.run(*pip, copy)
    before.run(*pip, "pluggy")
    before.run(*pip, "--no-binary", "msgpack", MSGPACK, MSGPACK_PUREPYTHON="1")
    for wheel in made.iterdir():
        with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(folder / wheel.name, "w") as new:
            for member in old.infolist():
                data = old.read(member)
                new.writestr(member, data, zipfile.ZIP_STORED)


def make_drive(before: Checkout, drive: Path, work: Path) -> None:
    """Build the payload, with the SDK of the version before, for any machine."""
    wheels, tools = work / "wheels", work / "tools"
    wheels.mkdir()
    runtime_wheels(before, wheels)
    before.run("-m", "pip", "download", "-q", "-d", tools, "hatchling")
    for compressed in tools.glob("pluggy-*.whl"):  # hatchling needs it, too: one is enough
        compressed.unlink()
    command = ("payload", "build", HERE / "crier", "-o", drive, "--release", "1", "--offline")
    before.nondum(*command, "--wheels", wheels, "--wheels", tools, "--python", "3.11")


def live_with(before: Checkout, drive: Path, work: Path) -> None:
    """Have a daemon install the payload, keep its drive, take a goal and pursue it."""
    command = ("--control", work / "control.sock")
    with before.daemon(work, "spot"):
        before.nondum(*command, "payload", "install", drive)
        (work / "slots/crier").symlink_to(drive)
        until(lambda: len(before.nondum(*command, "status")["drives"]) == 2)
        before.nondum(*command, "goal", "cry the hours", "--wait")
        before.nondum(*command, "mount", "spot__crier__mouth", "--xyz", "0.1", "0.2", "0.3")


def record_peers(before: Checkout, drive: Path, work: Path) -> dict[str, list[str]]:
    """What two hosts say to each other, until one has seen the other's component and used it."""
    files = {name: work / f"{name}.messages" for name in PORTS}
    with contextlib.ExitStack() as stack:
        for name, static in (("other", []), ("before", [f"127.0.0.1:{PORTS['other']}"])):
            (work / name).mkdir()
            more = PEERS.format(port=PORTS[name], static=static)
            program = (str(HERE / "recorded_daemon.py"), str(files[name]))
            stack.enter_context(before.daemon(work / name, name, more, *program))
        (work / "before/slots/crier").symlink_to(drive)
        command = ("--control", work / "other/control.sock")
        until(lambda: before.nondum(*command, "components"))
        before.nondum(*command, "goal", "--pddl", "(cried before)", "--maintain", "--wait")
    return {name: said(file) for name, file in files.items()}


def said(file: Path) -> list[str]:
    """The messages from the greeting on: pings are encoded before there is a link."""
    every = file.read_text(encoding="ascii").split()
    return list(itertools.dropwhile(lambda message: not message.startswith(GREETINGS), every))


def every_key(before: Checkout) -> str:
    """A configuration file with each key that there was, as its reference gives an example."""
    file = before.root / "host/nondum/host/configuration/keys.json"
    lines, last = [], ""
    for name, key in json.loads(file.read_text(encoding="utf-8")).items():
        section, _, name = name.partition(".")
        if section != last:
            lines.append(f"[{section}]")
        lines.append(f"{name} = {key['example']}")
        last = section
    return "\n".join([*lines, ""])


def packed(target: Path, work: Path) -> None:
    """Pack the drive and the state folder, as if Debian's Python had made the venvs; each file's
    owner, group and time left out."""
    for settings in (work / "state/venvs").rglob("pyvenv.cfg"):
        text = settings.read_text(encoding="utf-8")
        settings.write_text(re.sub("home = .*", f"home = {DEBIANS}", text), encoding="utf-8")

    def plain(member: tarfile.TarInfo) -> tarfile.TarInfo:
        member.uid = member.gid = member.mtime = 0
        member.uname = member.gname = ""
        if member.issym():
            member.linkname = f"{DEBIANS}/{Path(member.linkname).name}"
        return member

    with tarfile.open(target, "w:xz", preset=9) as archive:
        for name in ("drive", "state"):
            archive.add(work / name, name, filter=plain)


def main() -> None:
    """Make all files."""
    before = Checkout(Path(sys.argv[1]).resolve())
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as temporary:
        make_drive(before, WORK / "drive", Path(temporary))
        live_with(before, WORK / "drive", WORK)
        packed(HERE / "host.tar.xz", WORK)
        recorded = record_peers(before, WORK / "drive", Path(temporary))
    packets = json.loads(before.run(HERE / "samples.py"))
    text = json.dumps({"hosts": recorded, "packets": packets}, indent=1)
    (HERE / "recorded.json").write_text(f"{text}\n", encoding="utf-8")
    (HERE / "host.toml").write_text(every_key(before), encoding="utf-8")
    shutil.rmtree(WORK)


if __name__ == "__main__":
    main()
