"""The daemon that runs here, if one does, and the helper that it needs."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from pathlib import Path

from nondum.cli.examination.finding import Finding, bad, ok, warn
from nondum.host.config.host_config import HostConfig
from nondum.host.control.client import ControlClient
from nondum.host.sandbox.helper.client import SOCKET
from nondum.sdk.errors import NondumError

ENABLED = Path("/etc/systemd/system/multi-user.target.wants/nondum.service")
PATIENCE_S = 5.0


def examine(config: HostConfig) -> Iterator[Finding]:
    """Look for both."""
    control = config.host.control
    yield _daemon(control)
    if config.drives.block_devices:
        yield judge_service(is_systemd=Path("/run/systemd/system").exists(), link=ENABLED)
        yield judge_helper(_reached(SOCKET), os.geteuid())


def judge_helper(error: str, uid: int, path: Path = SOCKET) -> Finding:
    """Whether drives can be mounted; `error` is empty where somebody listens. Pure."""
    if uid == 0:
        return ok("helper", "asked by root, who needs none")
    if not error:
        return ok("helper", f"it is reached at {path}")
    if "denied" in error.lower():
        told = "it is there for the daemon's user alone, and was not asked"
        return ok("helper", told)
    told = f"it is not reached ({error}): drives cannot be mounted"
    return bad("helper", told, "`systemctl enable --now nondum-helper.socket`")


def judge_service(*, is_systemd: bool, link: Path) -> Finding:
    """Whether the daemon is started at boot."""
    if not is_systemd:
        return ok("service", "there is no systemd here: something else starts the daemon")
    if link.is_symlink():
        return ok("service", "it is started at boot")
    told = "it is not started at boot"
    return warn("service", told, "`systemctl enable --now nondum.service`")


def _daemon(control: Path) -> Finding:
    """Whether one answers at the configuration's socket, and how it says it is."""
    try:
        client = ControlClient(control, timeout_s=PATIENCE_S)
    except NondumError:
        told = f"none answers at {control}"
        return warn("daemon", told, "`nondum host run --user`, or start nondum.service")
    try:
        view = client.ask("status")
    except NondumError as error:
        return bad("daemon", f"it does not answer: {error}", "see its log")
    finally:
        client.close()
    told = f"{view['host']} answers: {view['state']}"
    if view.get("safe_mode", "off") != "off":
        return bad("daemon", told, "find out why it died (`nondum journal`), `nondum host resume`")
    if view["warnings"]:
        return warn("daemon", told, f"see `nondum status`: {view['warnings'][0]}")
    return ok("daemon", told)


def _reached(path: Path) -> str:
    """Why no process is reached at a socket; empty: a process listens there."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as sock:
        sock.settimeout(PATIENCE_S)
        try:
            sock.connect(str(path))
        except OSError as error:
            return error.strerror or str(error)
    return ""
