"""The root helper's command line: its unit runs `python -I -m nondum.host.sandbox.helper`."""

from __future__ import annotations

import argparse
import os
import pwd
import signal
import socket
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from nondum.host.config.host_config import SYSTEM_FILE, HostConfig
from nondum.host.config.parsing import load
from nondum.host.config.stop_keys import code_of
from nondum.host.config.stop_section import StopSection
from nondum.host.sandbox.cgroups import hierarchies
from nondum.host.sandbox.cgroups.groups import tree
from nondum.host.sandbox.cgroups.limits import Tree
from nondum.host.sandbox.helper import removals, stop_key
from nondum.host.sandbox.helper.device_nodes import Nodes
from nondum.host.sandbox.helper.disks import Disks
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.host.sandbox.helper.requests import refused
from nondum.host.sandbox.helper.server import IDLE_S, Server
from nondum.host.sandbox.helper.service import Service
from nondum.host.sandbox.helper.stop_key import PressesOfDevice

RUN = Path("/run/nondum-helper")
"""Root's own: who could replace a folder in it would choose where drives are mounted."""
FIRST = 3
"""SD_LISTEN_FDS_START."""
OWNER = "nondum-helper"


def main(arguments: Sequence[str] | None = None) -> None:
    """Serve one user by the socket that systemd passes (sd_listen_fds(3))."""
    told = _parser().parse_args(arguments)
    os.umask(0o022)
    uid = pwd.getpwnam(told.user).pw_uid
    service = Service(
        uid=uid,
        mounts=told.run / "mounts",
        disks=Disks(allow_loop=told.allow_loop),
        nodes=Nodes(told.run / "devices", uid, frozenset(told.allow_subsystem)),
        tree=_tree(f"{OWNER}-{uid}"),
        lamps=partial(_lamps, told.config, told.run / "lamps.json"),
        stop_key=partial(_stop_key, told.config),
    )
    service.nodes.prepare()  # sandboxes of workers, which are made early, show what is below it
    # No exception: Python drops those of signal handlers that run in its callbacks after a fork.
    ending, end = os.pipe()
    signal.signal(signal.SIGTERM, lambda *_: os.write(end, b"."))
    try:
        with _handed_over() as listening, removals.listen() as uevents:
            Server(listening, service, ending, uevents, told.idle_s).run()
    finally:
        service.tree.close()


def _tree(owner: str) -> Tree:
    """Cgroups outlive the helper, so they are not below its own cgroup, which ends with it."""
    return tree([replace(hierarchy, own=hierarchy.top) for hierarchy in hierarchies.here()], owner)


def _lamps(config: Path, kept: Path) -> Lamps:
    """The lamps that the configuration names. Raises `ConfigRefused`."""
    names = load(config, HostConfig()).feedback.lamps if config.exists() else ()
    return Lamps(names, kept)


def _stop_key(config: Path) -> PressesOfDevice:
    """The key that the configuration names. Raises `ConfigRefused`, `NondumError`."""
    section = load(config, HostConfig()).stop if config.exists() else StopSection()
    if not section.device:
        raise refused("root's configuration names no stop key", str(config))
    return stop_key.opened(Path(section.device), code_of(section.key) or 0)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="nondum-helper", description=__doc__)
    parser.add_argument("--user", default="nondum", help="the one user who is served")
    parser.add_argument("--run", type=Path, default=RUN, help="folder for mounts and devices")
    parser.add_argument(
        "--config",
        type=Path,
        default=SYSTEM_FILE,
        help="the daemon's, which names lamps and the stop key",
    )
    parser.add_argument("--idle-s", type=float, default=IDLE_S, help="end after such a silence")
    parser.add_argument("--allow-loop", action="store_true", help="loop devices are drives, too")
    parser.add_argument(
        "--allow-subsystem",
        action="append",
        default=[],
        metavar="NAME",
        help="give components devices of this subsystem that do not hang on USB",
    )
    return parser


def _handed_over() -> socket.socket:
    """The socket from systemd (sd_listen_fds(3))."""
    if os.environ.get("LISTEN_FDS") != "1" or os.environ.get("LISTEN_PID") != str(os.getpid()):
        raise SystemExit("this is started by nondum-helper.socket")
    return socket.socket(fileno=FIRST)


if __name__ == "__main__":
    main()
