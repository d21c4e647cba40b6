"""Users of the machine that are workers' alone: which worker has which, and how they are mapped.

The kernel counts some things by user, whatever namespace a process is in: descriptors under way
over unix sockets, memory of pipes, watches of epoll. A sandbox whose user namespace maps these
users to themselves can have its worker become one of them. Writing such a map takes root: the
daemon, or its helper (`nondum.host.sandbox.helper.worker_users`).
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import zlib
from pathlib import Path

from nondum.host.sandbox.helper import privileged
from nondum.host.sandbox.helper.worker_users import OF_ROOT, OF_SERVICE

FIRST_USER, USERS = OF_ROOT.start, len(OF_ROOT)
"""Ids of users that no account has, where the daemon is root."""
_TOLD_BYTES = 4096


def is_workers(user: int) -> bool:
    """Whether an id is that of a worker."""
    return user in OF_ROOT or user in OF_SERVICE


class Users:
    """Gives each scratch folder a user that no other one has. Where the folders are given to these
    users, the owner is what is kept of it, so that what a worker has written is its own again after
    a restart of the daemon."""

    def __init__(self, users: range) -> None:
        self._users = users
        self._given: dict[Path, int] = {}

    def of(self, scratch: Path) -> int:
        """The user of the worker with that scratch folder, `…/PAYLOAD/COMPONENT`, which is there.

        Raises `OSError`: the folder cannot be looked at, or all users are taken.
        """
        self._given = {at: user for at, user in self._given.items() if at.exists()}
        if scratch not in self._given:
            taken = {*self._given.values(), *_owners(scratch)}
            own = scratch.stat().st_uid
            self._given[scratch] = (
                own
                if own in self._users and own not in taken
                else _free(self._users, zlib.crc32(os.fsencode(scratch)), taken)
            )
        return self._given[scratch]


def _owners(scratch: Path) -> set[int]:
    """Of the other scratch folders."""
    found = set()
    for folder in scratch.parents[1].glob("*/*"):
        with contextlib.suppress(FileNotFoundError):  # removed just now
            if folder != scratch:
                found.add(folder.lstat().st_uid)
    return found


def _free(users: range, start: int, taken: set[int]) -> int:
    """The first that is not taken, from some place on: hosts of one machine begin elsewhere."""
    for step in range(len(users)):
        user = users[(start + step) % len(users)]
        if user not in taken:
            return user
    raise OSError(f"all {len(users)} users of workers are taken")


class NewNamespace:
    """A user namespace that bubblewrap makes, and waits for the ids of (`--userns-block-fd`)."""

    def __init__(self) -> None:
        """Raises `OSError`."""
        self._tells, told = os.pipe()
        try:
            waits, self._goes = os.pipe()
        except OSError:
            os.close(self._tells)
            os.close(told)
            raise
        self._its_ends = (told, waits)

    @property
    def descriptors(self) -> tuple[int, ...]:
        """What bubblewrap is to inherit. The end that is read here is among them: else bubblewrap
        could not write of its namespace once the daemon has died, and would leave it as it is."""
        return *self._its_ends, self._tells

    @property
    def flags(self) -> tuple[str, ...]:
        """What bubblewrap is told."""
        told, waits = self._its_ends
        return "--info-fd", str(told), "--userns-block-fd", str(waits)

    def started(self) -> None:
        """Bubblewrap has been started, or could not be."""
        for descriptor in self._its_ends:
            os.close(descriptor)

    def map_users(self, startup_s: float) -> None:
        """Have its users be those of workers, and the daemon's; then it is left. Call it once.

        Blocks. Bubblewrap may have ended meanwhile. Raises `OSError`, `TimeoutError` if it has made
        no namespace within `startup_s`.
        """
        try:
            process = self._process(startup_s)
            if process is not None:
                privileged().map_users(process)
                os.write(self._goes, b"!")
        finally:
            self.close()

    def close(self) -> None:
        """Leave it without ids."""
        os.close(self._tells)
        os.close(self._goes)

    def _process(self, startup_s: float) -> int | None:
        """The one in the namespace, as bubblewrap tells it; None if that ended before."""
        told, poll = b"", select.poll()
        poll.register(self._tells, select.POLLIN)
        while not told.endswith(b"}\n"):  # its other end stays open as long as that process waits
            if not poll.poll(startup_s * 1000):
                raise TimeoutError(f"bubblewrap has made no user namespace in {startup_s:g} s")
            more = os.read(self._tells, _TOLD_BYTES)
            if not more:
                return None
            told += more
        return int(json.loads(told)["child-pid"])
