"""Where daemons listen for commands, as long as no file says otherwise.

Text and no `pathlib`, which takes as long to import as a stop takes (`nondum.cli.stop_first`).
"""

from __future__ import annotations

import os
from collections.abc import Iterator

SYSTEM = "/run/nondum/control.sock"


def user_state() -> str:
    """Where a host that a user runs without root keeps what it knows."""
    home = os.environ.get("XDG_STATE_HOME") or os.path.expanduser("~/.local/state")  # noqa: PTH111
    return f"{home}/nondum"


def user_socket() -> str:
    """Of a host that a user runs without root: in the user's runtime folder, if there is one."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return f"{runtime}/nondum/control.sock" if runtime else f"{user_state()}/control.sock"


def usual_sockets() -> Iterator[str]:
    """This user's, with or without a login session, then the system's."""
    yield user_socket()
    yield f"{user_state()}/control.sock"
    yield SYSTEM
