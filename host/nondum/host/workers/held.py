"""Level `restricted`: a worker that stays on the host and gives up what it can of it."""

from __future__ import annotations

import contextlib
import os
import stat
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path

from nondum.host.sandbox.levels import bubblewrap, landlock, refusals
from nondum.host.sandbox.levels.bubblewrap import Ground
from nondum.host.sandbox.levels.users import FIRST_USER, USERS, NewNamespace
from nondum.host.workers.confinement import (
    EVERYWHERE,
    Confinement,
    Entry,
    calls_refused,
    interpreter_command,
)
from nondum.host.workers.granted_nodes import groups_of, instruments, nodes_of
from nondum.host.workers.spec import WorkerSpec, base_interpreter
from nondum.wheelhouse.format.confinement import Level


class Held:
    """Level `restricted`: the worker stays on the host and gives up what it can of it."""

    level = Level.RESTRICTED
    has_init = False
    has_users = False

    def __init__(self, *, without: Collection[str] = (), abi: int | None = None) -> None:
        """`abi` is what is used of Landlock, if not all that the kernel has."""
        self.without = frozenset(without)
        self._abi = landlock.version() if abi is None else abi

    def ground(self, spec: WorkerSpec | None) -> Ground:
        """The interpreter, wherever it is."""
        return Ground(spec.python if spec else base_interpreter(), EVERYWHERE)

    def command(
        self, ground: Ground, orders: int, namespace: NewNamespace | None = None
    ) -> list[str]:
        """The interpreter itself."""
        return interpreter_command(ground, orders)

    @contextlib.contextmanager
    def entry(self, spec: WorkerSpec, ground: Ground) -> Iterator[Entry]:
        """Files by Landlock, calls by a filter, and a separate user if the host is root."""
        has_network = "network" in spec.permissions
        groups = {
            **refusals.GROUPS,
            **refusals.WITHOUT_NAMESPACES,
            "sockets": refusals.SOCKETS_OF_THE_HOST[has_network],
        }
        user = None if "user" in self.without else user_for(spec)
        if user is None:
            groups |= refusals.WITH_THE_HOSTS_USER
            groups |= refusals.TRUNCATION if self._abi < landlock.TRUNCATES else {}
        nodes = (*(instruments() if spec.index.devices else ()), *nodes_of(spec))
        restrictions = {
            "user": user,
            "groups": sorted(groups_of(nodes)),
            "keeps_capabilities": "capabilities" in self.without,
            "may_gain_privileges": "new privileges" in self.without,
            "filter": calls_refused(groups, self.without),
        }
        if "landlock" in self.without or not self._abi:
            yield Entry(restrictions, user=user)
            return
        with landlock.ruleset(
            readable=(*spec.readable, *bubblewrap.prefixes(), *_more_files(spec)),
            writable=(spec.scratch,),
            nodes=nodes,
            has_network=has_network,
            abi=self._abi,
        ) as ruleset:
            yield Entry(restrictions, ruleset=ruleset, user=user)


def changes_user(confinement: Confinement) -> bool:
    """Whether workers may be other users of this machine than the host."""
    return isinstance(confinement, Held) and os.geteuid() == 0


def user_for(spec: WorkerSpec) -> int | None:
    """The user that a worker of root runs as, the same each time; None where there is none to be
    had: the host is not root, or what the worker must read is root's alone.
    """
    if os.getuid() != 0:
        return None
    needed = (*bubblewrap.prefixes(), *spec.site_packages, spec.scratch.parent)
    if not all(map(_is_open, needed)):
        return None
    return FIRST_USER + zlib.crc32(spec.component.encode()) % USERS


def _is_open(folder: Path) -> bool:
    """Whether everybody may go there and read."""
    real = folder.resolve()
    try:
        above = all(p.stat().st_mode & stat.S_IXOTH for p in real.parents)
        return above and bool(real.stat().st_mode & stat.S_IROTH)
    except OSError:
        return False


def _more_files(spec: WorkerSpec) -> Iterator[Path]:
    if "gpu" in spec.permissions:
        yield Path("/sys")
