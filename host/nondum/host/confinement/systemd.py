"""Level 2: what systemd is asked to be around a worker, as a transient service. Pure.

Sources: systemd-run(1), systemd.exec(5), systemd.resource-control(5). Tried with systemd 252: a
transient service inherits no descriptors but its standard ones (`--pipe`), so the socket at which
the interpreter hears its orders is its standard input; `OpenFile=` is newer.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from nondum.host.cgroups.services import SLICE
from nondum.host.confinement import bubblewrap

MAX_BYTES = 16 * 1024
"""Of a request."""
COMPONENT = re.compile(r"[a-z0-9](?:[a-z0-9-]{0,62})")
FOLDER = re.compile(r"(?:/[A-Za-z0-9_+@=,~-][A-Za-z0-9._+@=,~-]*)+")
"""Nothing that systemd would take for a separator, a specifier or a way back."""
PERMISSIONS = frozenset({"network", "audio", "gpu"})
"""Those that change the service."""
ROOM = "NONDUM_ROOM"

_ALWAYS = (
    *("DynamicUser=yes", "ProtectSystem=strict", "ProtectHome=tmpfs", "PrivateTmp=yes"),
    *("PrivateIPC=yes", "ProtectProc=invisible", "ProcSubset=pid", "ProtectClock=yes"),
    *("ProtectControlGroups=yes", "ProtectHostname=yes", "ProtectKernelLogs=yes"),
    *("ProtectKernelModules=yes", "ProtectKernelTunables=yes", "KeyringMode=private"),
    *("NoNewPrivileges=yes", "CapabilityBoundingSet=", "AmbientCapabilities="),
    *("RestrictNamespaces=yes", "RestrictRealtime=yes", "RestrictSUIDSGID=yes"),
    *("LockPersonality=yes", "RemoveIPC=yes", "UMask=0077", "NotifyAccess=none"),
    *("SystemCallArchitectures=native", "SystemCallErrorNumber=EPERM"),
    *("SystemCallFilter=@system-service", "SystemCallFilter=~@privileged"),
    *("MemorySwapMax=0", "OOMPolicy=kill", "KillMode=control-group", "TimeoutStopSec=2"),
    *("LimitCORE=0", "PartOf=nondum.service", "Description=A worker of nondum"),
    f"Slice={SLICE}",
)
_SEEN = ("usr", "bin", "sbin", "lib", "lib32", "lib64", "libx32", "proc", "dev", "sys", "tmp")
"""Of the folders at the top, those that are not hidden whole."""
_SYSTEM = frozenset(_SEEN) - {"tmp"}
_CLASSES: Mapping[str, tuple[str, ...]] = {
    "audio": ("char-alsa",),
    "gpu": ("char-drm", "char-nvidia*", "char-kfd"),
}
_INSTRUMENTS = (
    *("char-188", "char-166", "char-189", "char-81", "char-89", "char-153"),
    *("char-hidraw", "char-media", "char-gpiochip", "char-pts"),
)
"""What a worker that declares devices may open: USB serial lines (188, 166), USB devices (189),
cameras (81), I2C (89) and SPI (153) by numbers, which are theirs for good (devices.txt), since a
driver may be loaded only after the worker has started; systemd looks names up at that moment.
"""


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked of the warden. `parse` checks; whoever makes one by hand is trusted."""

    component: str
    code: tuple[str, ...]
    """Folders to read."""
    scratch: str
    """The folder to write: memory, which ends with the service."""
    permissions: tuple[str, ...]
    has_devices: bool
    memory_mb: int
    tasks: int
    descriptors: int
    scratch_mb: int
    cpu_weight: int
    processors: float
    """Processor seconds in a second; 0: no limit."""

    def encode(self) -> bytes:
        """As it travels."""
        return json.dumps(asdict(self), separators=(",", ":")).encode()


@dataclass(frozen=True, slots=True)
class Machine:
    """What the warden knows of its machine, and takes nobody's word for."""

    python: Path
    """The base interpreter."""
    top: tuple[str, ...]
    """Names of the folders at the top of the file system, links left out."""
    groups: tuple[str, ...] = ()
    """Groups that own devices."""
    mark_bytes: int = 2048
    prefixes: tuple[Path, ...] = field(default=())
    """Where the interpreter's own files are, if not with the system's."""


def parse(data: bytes, places: Collection[Path]) -> Request:
    """Read a request from a daemon whose workers' code lies in `places`. Raises `ValueError`."""
    try:
        body = json.loads(data[:MAX_BYTES])
    except RecursionError:
        raise ValueError("a request is no such heap of brackets") from None
    if not isinstance(body, dict) or body.keys() != {each.name for each in fields(Request)}:
        raise ValueError("a request has other parts")
    parts: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in body.items()}
    request = Request(**parts)
    if type(request.code) is not tuple or type(request.permissions) is not tuple:
        raise ValueError("a list is expected")
    if not COMPONENT.fullmatch(_text(request.component)):
        raise ValueError("that is no component")
    for folder in (*request.code, request.scratch):
        if not FOLDER.fullmatch(_text(folder)):
            raise ValueError(f"not a folder of a worker: {folder}")
    if not all(_is_within(Path(folder), places) for folder in request.code):
        raise ValueError("code from elsewhere")
    if Path(request.scratch).parts[1] in _SYSTEM:  # any other place will do: nothing is there
        raise ValueError("no scratch folder may hide the system")
    if not PERMISSIONS.issuperset(map(_text, request.permissions)):
        raise ValueError("there is no such permission")
    if type(request.has_devices) is not bool:
        raise ValueError("has_devices is true or false")
    for name in ("memory_mb", "tasks", "descriptors", "scratch_mb", "cpu_weight"):
        value = getattr(request, name)
        if type(value) is not int or not 1 <= value <= 2**30:
            raise ValueError(f"{name} is no number that can be held to")
    if type(request.processors) is not float or not 0.0 <= request.processors <= 10_000.0:
        raise ValueError("that is no number of processors")
    return request


def unit_of(component: str, stand_in: int) -> str:
    """The unit of the service for which a process of the daemon's stands in.

    Both ends know it without being told: the warden sees whose connection it serves.

    >>> unit_of("talker", 4711)
    'nondum-worker-talker-4711.service'
    """
    return f"nondum-worker-{component}-{stand_in}.service"


def command(request: Request, unit: str, machine: Machine) -> list[str]:
    """How the service is started: its standard input is the socket for orders, and what it writes
    goes where systemd-run's own output goes. Ends when the service has.
    """
    inside = bubblewrap.PLACE_OF_INSIDE
    return [
        *("systemd-run", "--quiet", "--pipe", "--wait", f"--unit={unit}"),
        f"--setenv={ROOM}={'-' * machine.mark_bytes}",
        "--setenv=MALLOC_ARENA_MAX=2",
        *(part for each in properties(request, machine) for part in ("-p", each)),
        *(str(machine.python), "-I", "-S", "-B", "-u", str(inside / "bootstrap.py"), "0", "0"),
    ]


def properties(request: Request, machine: Machine) -> Iterator[str]:
    """What makes the service small: its view, its rights, and its limits."""
    yield from _ALWAYS
    yield from _view(request, machine)
    yield from _network("network" in request.permissions)
    yield from _devices(request, machine.groups)
    yield f"MemoryMax={request.memory_mb}M"
    yield f"TasksMax={request.tasks}"
    yield f"LimitNOFILE={request.descriptors}"
    yield f"CPUWeight={request.cpu_weight}"
    if request.processors:
        yield f"CPUQuota={max(1, int(request.processors * 100))}%"


def _view(request: Request, machine: Machine) -> Iterator[str]:
    hidden = [f"/{name}:ro" for name in machine.top if name not in _SEEN]
    yield f"TemporaryFileSystem={' '.join(hidden)}"
    yield f"TemporaryFileSystem={request.scratch}:mode=0777,size={request.scratch_mb}M"
    # They are folders of the host's disk, which a worker could fill: TMPDIR is its scratch folder.
    yield "ReadOnlyPaths=/tmp /var/tmp"
    yield "TemporaryFileSystem=/dev/shm:mode=1777,size=64M,nodev,nosuid,noexec"
    if "gpu" not in request.permissions:
        yield "InaccessiblePaths=/sys"
    inside, place = bubblewrap.INSIDE, bubblewrap.PLACE_OF_INSIDE
    yield f"BindReadOnlyPaths={inside}:{place}"
    shown = [*bubblewrap.settings(request.permissions), *map(str, machine.prefixes)]
    yield f"BindReadOnlyPaths={' '.join(f'-{path}' for path in shown)}"
    for folder in request.code:
        yield f"BindReadOnlyPaths={folder}"


def _network(is_granted: bool) -> Iterator[str]:  # noqa: FBT001  # read where it is called
    if is_granted:
        yield "RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK"
        return
    yield "PrivateNetwork=yes"
    yield "RestrictAddressFamilies=AF_UNIX AF_NETLINK"
    yield "IPAddressDeny=any"


def _devices(request: Request, groups: Sequence[str]) -> Iterator[str]:
    wanted = [c for p in request.permissions for c in _CLASSES.get(p, ())]
    wanted += _INSTRUMENTS if request.has_devices else ()
    if not wanted:
        yield "PrivateDevices=yes"
        return
    yield "DevicePolicy=closed"
    yield from (f"DeviceAllow={each} rw" for each in wanted)
    if groups:
        yield f"SupplementaryGroups={' '.join(groups)}"


def _is_within(folder: Path, places: Collection[Path]) -> bool:
    real = folder.resolve()
    return any(real.is_relative_to(place) and real != place for place in places)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError("a text is expected")
    return value
