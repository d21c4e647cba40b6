"""Devices of the machine that belong to a worker's own user for as long as it has them.

As login(1) does with terminals: only a node's owner and group may open it, and a worker that is a
separate user is neither. Takes root: elsewhere the helper has made a node for that user.
"""

from __future__ import annotations

import contextlib
import os
import stat
from pathlib import Path

from nondum.host.sandbox.levels.users import is_workers

_ANYBODY = stat.S_IROTH | stat.S_IWOTH


class DeviceOwnership:
    """Of one worker. All of it may block: not for the loop."""

    def __init__(self, user: int | None) -> None:
        """`user` is the worker's, if not the host's, which needs nothing."""
        self._user = user if os.geteuid() == 0 else None
        self._lent: dict[str, tuple[str, int]] = {}
        """Name → node, and whose that was."""

    def lend(self, name: str, node: str) -> None:
        """Have a node be the worker's user's, unless anybody may open it."""
        if self._user is None:
            return
        with contextlib.suppress(FileNotFoundError):  # pulled meanwhile
            found = Path(node).stat()
            is_device = stat.S_ISCHR(found.st_mode) or stat.S_ISBLK(found.st_mode)
            if not is_device or found.st_uid == self._user or found.st_mode & _ANYBODY == _ANYBODY:
                return
            os.chown(node, self._user, -1)
            # What a daemon that died has lent was root's, as far as is known.
            self._lent[name] = node, 0 if is_workers(found.st_uid) else found.st_uid

    def take_back(self, name: str) -> None:
        """Have it be whose it was, unless it is another node by now; nothing lent is fine."""
        node, owner = self._lent.pop(name, ("", 0))
        with contextlib.suppress(FileNotFoundError):
            if node and Path(node).stat().st_uid == self._user:
                os.chown(node, owner, -1)
