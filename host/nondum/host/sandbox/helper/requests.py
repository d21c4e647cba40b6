"""What the helper can be asked, as values and as bytes: a request of a worker link for each. Pure.

No request carries a path: drives are named by kernel name and insertion number, folders of devices
by component, cgroups by their own names, and lamps not at all. Everything else is refused before
anything is done.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, TypeAlias, get_args

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.cgroups.limits import NAME as CGROUP_NAME
from nondum.host.sandbox.cgroups.limits import CgroupLimits
from nondum.sdk import wire
from nondum.sdk.codec.checks import Bounds, matching
from nondum.sdk.codec.values import from_plain, to_plain
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.frozen import frozen

MAX_BYTES = 1024
"""Of a request."""
CALL = 1
"""The number of the one request of a connection."""
HEARD = "heard"
"""The event that comes before an answer: the helper runs, and is at it."""
LISTENING, PRESSED = "listening", "pressed"
"""Events that belong to `ListenToStopKey`."""

DEVICE = re.compile(r"[a-z][a-z0-9]{1,31}")
DRIVE = re.compile(r"[a-z][a-z0-9]{1,31}(-[0-9]{1,19})?")
COMPONENT = re.compile(r"[a-z0-9][a-z0-9-]{0,62}")
NEED = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}(\.[A-Za-z0-9][A-Za-z0-9_-]{0,62})?")
FILESYSTEM = re.compile(r"[a-z0-9]{0,16}")

Device: TypeAlias = Annotated[str, matching(DEVICE)]
Drive: TypeAlias = Annotated[str, matching(DRIVE)]
Use: TypeAlias = Annotated[str, matching(re.compile("read|handover"))]
"""Reading by this host, or handing over to another: a drive may be mounted once for each."""
Component: TypeAlias = Annotated[str, matching(COMPONENT)]
Need: TypeAlias = Annotated[str, matching(NEED)]
Cgroup: TypeAlias = Annotated[str, matching(CGROUP_NAME)]
Number: TypeAlias = Annotated[int, Bounds(0, 2**63 - 1)]
Pid: TypeAlias = Annotated[int, Bounds(0, 2**31 - 1)]
"""Above it the kernel's calls do not take them."""


@frozen
class Mount:
    """Mount a drive for reading; the answer is where."""

    device: Device
    """Kernel name: `sdb1`."""
    diskseq: Number | None
    """Insertion number; None: the kernel counts none."""
    filesystem: Annotated[str, matching(FILESYSTEM)]
    """Empty: as the drive says."""
    use: Use


@frozen
class Unmount:
    """Unmount a drive."""

    drive: Drive
    """Kernel name and insertion number: `sdb1-42`."""
    use: Use


@frozen
class UnmountAll:
    """Unmount all drives: what a daemon left that died."""


@frozen
class PutNode:
    """Make a node of a character device in a component's folder; the answer is where."""

    component: Component
    need: Need
    major: Number
    minor: Number
    user: Number | None
    """Whose it is: a worker's; None: the daemon's."""


@frozen
class TakeNode:
    """Remove a node."""

    component: Component
    need: Need


@frozen
class ClearNodes:
    """Remove all nodes of a component; empty: of all."""

    component: Annotated[str, matching(re.compile(f"({COMPONENT.pattern})?"))]


@frozen
class MapUsers:
    """Have a user namespace that a process of the daemon's has made know the users of workers."""

    pid: Pid


@frozen
class MapFolder:
    """Have a mount, which comes as a descriptor, show the daemon's files as those of a worker."""

    user: Number
    """The worker's."""


@frozen
class ShowLamps:
    """Have the lamps that root's configuration names show a state."""

    state: State


@frozen
class EndLamps:
    """Have them show what they showed before."""


@frozen
class ListCgroups:
    """Which kind of cgroups there is, what they limit, and which cgroups there are."""


@frozen
class ReadCgroup:
    """What a cgroup uses, and the processes in it."""

    cgroup: Cgroup


@frozen
class MakeCgroup:
    """Make a cgroup without limits."""

    cgroup: Cgroup


@frozen
class LimitCgroup:
    """Set a cgroup's limits."""

    cgroup: Cgroup
    memory_mb: Number
    tasks: Number
    cpu_weight: Number
    processors: Annotated[float, Bounds(0, 2**63)]

    @property
    def limits(self) -> CgroupLimits:
        """The limits. Raises `ValueError`."""
        return CgroupLimits(self.memory_mb, self.tasks, self.cpu_weight, self.processors)


@frozen
class FillCgroup:
    """Put a process of the caller's own user into a cgroup."""

    cgroup: Cgroup
    pid: Pid


@frozen
class KillCgroup:
    """SIGKILL all that is in a cgroup."""

    cgroup: Cgroup


@frozen
class RemoveCgroup:
    """Remove an empty cgroup; the answer is whether it is gone."""

    cgroup: Cgroup


@frozen
class ListenToStopKey:
    """Tell each press of the key that root's configuration names, until the caller hangs up.

    The event `listening` tells whether it is `down` already; then `pressed` comes each time, with
    how many `times` it was.
    """


Request: TypeAlias = (
    Mount
    | Unmount
    | UnmountAll
    | PutNode
    | TakeNode
    | ClearNodes
    | MapUsers
    | MapFolder
    | ShowLamps
    | EndLamps
    | ListCgroups
    | ReadCgroup
    | MakeCgroup
    | LimitCgroup
    | FillCgroup
    | KillCgroup
    | RemoveCgroup
    | ListenToStopKey
)

_VERBS: Mapping[str, type[Request]] = {kind.__name__: kind for kind in get_args(Request)}


def encode(request: Request) -> bytes:
    """A request as it travels.

    >>> wire.decode(encode(Unmount("sdb1-7", "read")))
    Request(id=1, verb='Unmount', body={'drive': 'sdb1-7', 'use': 'read'})
    """
    return wire.encode(wire.Request(CALL, type(request).__name__, to_plain(request)))


def parse(data: bytes) -> Request:
    """The request in a packet. Raises `NondumError` (HELPER_REFUSED)."""
    try:
        asked = wire.decode(data, MAX_BYTES)
    except ProtocolViolation as violation:
        raise refused(violation.problems[0].message) from None
    if not isinstance(asked, wire.Request) or asked.id != CALL:
        raise refused("a connection is for one request")
    kind = _VERBS.get(asked.verb)
    if kind is None:
        raise refused("there is no such verb")
    try:
        request = from_plain(kind, asked.body, kind.__name__)
        if isinstance(request, LimitCgroup):
            _ = request.limits
    except ValueError as error:
        raise refused(str(error)) from None
    return request


def refused(message: str, where: str = "") -> NondumError:
    """What the helper answers when it will not."""
    fix = "this is for nondum's own daemon: report it, if that was the one who asked"
    return NondumError(Problem("HELPER_REFUSED", message, where=where, fix=fix))
