"""A daemon of another user than root, with root's helper, whose /run is their own.

`python -m tests.sandbox.service` is root's end: it starts a helper, and, as the user,
`service_checks.py`, which tells one JSON object: name of each check → why it failed, or nothing.
"""

from __future__ import annotations

import json
import os
import pwd
import socket
import stat
import subprocess
import sys
from pathlib import Path

from nondum.host.sandbox.helper.client import SOCKET
from nondum.host.sandbox.inside import kernel

USER = pwd.getpwnam("daemon")
GROUP = 29
"""One that the user is in beside its own."""
PYTHON, CODE, STATE = Path("/run/python"), Path("/run/code"), Path("/run/state")
LINE, LINE_OF_GROUP = Path("/run/nodes/line"), Path("/run/nodes/line-of-group")
ROOT = Path(__file__).parents[2]


def results() -> dict[str, str]:
    """What the checks of `service_checks` have found. Takes root."""
    command = ["unshare", "--mount", sys.executable, "-m", "tests.sandbox.service"]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    found: dict[str, str] = json.loads(told.stdout.splitlines()[-1])
    return found


def main() -> None:
    """Root's end, in its mount namespace."""
    kernel.mount("tmpfs", "/run", "tmpfs", kernel.MS_NOSUID, "mode=755")
    PYTHON.mkdir()
    kernel.mount(sys.base_prefix, str(PYTHON), None, kernel.MS_BIND)
    for folder, seen in _code().items():
        seen.mkdir(parents=True)
        kernel.mount(folder, str(seen), None, kernel.MS_BIND)
    STATE.mkdir()
    os.chown(STATE, USER.pw_uid, USER.pw_gid)
    LINE.parent.mkdir()
    for line, mode, group in ((LINE, 0o600, 0), (LINE_OF_GROUP, 0o660, GROUP)):  # as /dev/full
        os.mknod(line, stat.S_IFCHR, os.makedev(1, 7))
        os.chown(line, 0, group)
        line.chmod(mode)
    SOCKET.parent.mkdir()
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(SOCKET))
        os.chown(SOCKET, USER.pw_uid, USER.pw_gid)
        listening.listen(64)
        helper = subprocess.Popen(
            [
                *("sh", "-c", 'export LISTEN_PID=$$ LISTEN_FDS=1; exec "$@"', "sh"),
                *(sys.executable, "-m", "nondum.host.sandbox.helper", "--user", USER.pw_name),
                *("--allow-subsystem", "mem"),
            ],
            preexec_fn=lambda: os.dup2(listening.fileno(), 3),
            pass_fds=(3,),
        )
    try:
        sys.stdout.write(_as_the_user())
    finally:
        helper.terminate()
        helper.wait()


def _code() -> dict[str, Path]:
    """Folder that Python imports from → where the user sees it: who may not open the one above it,
    as a checkout in root's home or tox's folder, may open that."""
    folders = (path for path in dict.fromkeys(sys.path) if Path(path).is_dir())
    return {folder: CODE / str(number) for number, folder in enumerate(folders)}


def _as_the_user() -> str:
    python = PYTHON / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}"
    command = ["setpriv", "--no-new-privs", f"--reuid={USER.pw_uid}", f"--regid={USER.pw_gid}"]
    command += [f"--groups={GROUP}", str(python), "-B", "-m", "tests.sandbox.service_checks"]
    paths = {"PYTHONPATH": ":".join(map(str, _code().values())), "HOME": "/"}
    done = subprocess.run(
        command,
        cwd="/",
        env={**os.environ, **paths},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 0
    return done.stdout


if __name__ == "__main__":
    main()
