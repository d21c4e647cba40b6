"""Writing `pylock.<component>.toml`: the wheels of every target in one lock (PEP 751)."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from packaging.utils import parse_wheel_filename

from nondum.wheelhouse.format import lock
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.wheels import wheel

CREATED_BY = "nondum"


def lock_text(chosen: Mapping[Target, Sequence[Path]]) -> str:
    """A lock of what was fetched for each target; wheels lie in `wheels/` beside it.

    A version that only some targets have gets a marker that is true on them.
    """
    packages: dict[tuple[str, str], dict[str, Path]] = {}
    users: dict[tuple[str, str], set[Target]] = {}
    for target, wheels in chosen.items():
        for path in wheels:
            name, version, _, _ = parse_wheel_filename(path.name)
            key = (str(name), str(version))
            packages.setdefault(key, {})[path.name] = path
            users.setdefault(key, set()).add(target)
    lines = ['lock-version = "1.0"', f'created-by = "{CREATED_BY}"']
    for key in sorted(packages):
        lines += _package(key, packages[key], users[key], every=set(chosen))
    return "\n".join(lines) + "\n"


def sha256(path: Path) -> str:
    """Hex digest of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _unpacked(path: Path) -> int:
    """Bytes of the files that are installed from a wheel; none of one that is refused."""
    with wheel.opened(path) as data:
        return wheel.lay_out(data, path.name).size


def _package(
    key: tuple[str, str], wheels: Mapping[str, Path], users: set[Target], *, every: set[Target]
) -> Iterator[str]:
    name, version = key
    yield from ("", "[[packages]]", f'name = "{name}"', f'version = "{version}"')
    if users != every:
        yield f'marker = "{" or ".join(target.marker for target in sorted(users))}"'
    yield f"[packages.tool.{lock.TOOL}.{lock.UNPACKED}]"
    yield from (f'"{filename}" = {_unpacked(wheels[filename])}' for filename in sorted(wheels))
    for filename in sorted(wheels):
        yield "[[packages.wheels]]"
        yield f'name = "{filename}"'
        yield f'path = "wheels/{filename}"'
        yield f"size = {wheels[filename].stat().st_size}"
        yield f'hashes = {{ sha256 = "{sha256(wheels[filename])}" }}'
