"""Which cgroup hierarchies this process sees, and where in them it is. Pure (cgroups(7))."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from nondum.sdk.frozen import frozen


@frozen
class Mounted:
    """One mounted hierarchy."""

    top: Path
    """Where it is mounted."""
    own: Path
    """The folder of this process's own cgroup; `top` where that is not to be seen."""
    controllers: frozenset[str]
    """Of version 1; none: it is of version 2."""


def mounted(mountinfo: str, cgroup: str) -> tuple[Mounted, ...]:
    """The hierarchies in `/proc/self/mountinfo`, by `/proc/self/cgroup`.

    >>> line = "30 24 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw"
    >>> print(mounted(line, "0::/nondum.service")[0].own)
    /sys/fs/cgroup/nondum.service
    """
    places = dict(_places(cgroup))
    return tuple(_hierarchies(mountinfo, places))


def here() -> tuple[Mounted, ...]:
    """The hierarchies that this process sees."""
    return mounted(
        Path("/proc/self/mountinfo").read_text(encoding="utf-8"),
        Path("/proc/self/cgroup").read_text(encoding="utf-8"),
    )


def _places(cgroup: str) -> Iterator[tuple[frozenset[str], str]]:
    for line in cgroup.splitlines():
        _, names, path = line.split(":", 2)
        yield frozenset(filter(None, names.split(","))), path


def _hierarchies(mountinfo: str, places: dict[frozenset[str], str]) -> Iterator[Mounted]:
    seen: set[frozenset[str]] = set()
    for line in mountinfo.splitlines():
        before, _, after = line.partition(" - ")
        root, top = (_unescaped(field) for field in before.split()[3:5])
        kind, _, options = after.split()[:3]
        if kind not in ("cgroup", "cgroup2"):
            continue
        named = frozenset(options.split(",")) if kind == "cgroup" else frozenset[str]()
        found = next(
            (names for names in places if names <= named and bool(names) == bool(named)), None
        )
        if found is None or found in seen:
            continue
        seen.add(found)
        yield Mounted(Path(top), _own(top, root, places[found]), found)


def _own(top: str, root: str, path: str) -> Path:
    """A mount may show a part of the hierarchy only, below `root`."""
    inside = PurePosixPath(path)
    if ".." in inside.parts or not inside.is_relative_to(root):
        return Path(top)
    return Path(top) / inside.relative_to(root)


def _unescaped(field: str) -> str:
    return re.sub(r"\\([0-7]{3})", lambda match: chr(int(match[1], 8)), field)
