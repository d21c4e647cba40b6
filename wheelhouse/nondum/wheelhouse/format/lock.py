"""`pylock.<component>.toml`: a component's wheels for all architectures and Pythons (PEP 751).

The packaging library parses and selects; what is refused beyond it: anything but wheels, wheels
that do not lie inside the payload, and wheels without size or SHA-256.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any, NoReturn

from packaging.markers import EvaluateContext, Marker, UndefinedEnvironmentName
from packaging.pylock import Package, Pylock, PylockSelectError, PylockValidationError
from packaging.tags import Tag
from packaging.utils import InvalidWheelFilename, canonicalize_name, parse_wheel_filename

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import names
from nondum.wheelhouse.format.contents import MAX_FILE_BYTES

MAX_BYTES = 1024 * 1024
MAX_DIGITS = 250
"""Digits in a row. Python makes no number of more than 4,300 (`int`), wherever one is compared."""
TOOL, UNPACKED = "nondum", "unpacked"
"""Where a package's table says how many bytes are installed from each of its wheels."""

_ENDLESS = re.compile(f"[0-9]{{{MAX_DIGITS + 1}}}")
_SHA256 = re.compile(r"[0-9a-f]{64}")

Environment = Mapping[str, str]
"""Environment markers (PEP 508) of the host that is installed on."""


@frozen
class LockedWheel:
    """A wheel that a lock names."""

    name: str
    """Normalised distribution name."""
    version: str
    path: str
    """Relative to the payload folder."""
    sha256: str
    size: int
    unpacked: int
    """Bytes of the files that are installed from it, as the lock says; its own size where no lock
    does."""

    @property
    def filename(self) -> str:
        """The wheel's own name, with its tags."""
        return PurePosixPath(self.path).name

    @property
    def tags(self) -> frozenset[Tag]:
        """What it runs on."""
        return parse_wheel_filename(self.filename)[3]


@frozen
class Lock:
    """A parsed lock."""

    where: str
    parsed: Pylock
    wheels: tuple[LockedWheel, ...]
    """All of them, whatever they run on."""

    @property
    def packages(self) -> frozenset[str]:
        """Names of the distributions that it locks."""
        return frozenset(str(package.name) for package in self.parsed.packages)


def file_name(component: str) -> str:
    """Name of a component's lock.

    >>> file_name("blinker")
    'pylock.blinker.toml'
    """
    return f"pylock.{component}.toml"


def parse(text: str, where: str) -> Lock:
    """Check and parse a lock. Raises `PayloadRefused` with everything wrong in it."""
    if len(text.encode()) > MAX_BYTES:
        _refuse(Problem("TOO_LARGE", f"is longer than {MAX_BYTES} bytes", where=where))
    if _ENDLESS.search(text):
        told = f"a number has more than {MAX_DIGITS} digits"
        _refuse(Problem("LOCK_INVALID", told, where=where, fix="build the payload again"))
    try:
        parsed = Pylock.from_dict(tomllib.loads(text))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        _refuse(Problem("LOCK_TOML", f"is not TOML: {error}", where=where))
    except (PylockValidationError, ValueError, TypeError) as error:
        _refuse(Problem("LOCK_INVALID", f"is not a lock (PEP 751): {error}", where=where))
    problems = [p for package in parsed.packages for p in flaws(package, where)]
    if problems:
        raise PayloadRefused(*problems)
    return Lock(where, parsed, tuple(_wheels(parsed)))


def select(lock: Lock, environment: Environment, tags: Sequence[Tag]) -> tuple[LockedWheel, ...]:
    """The wheels for one host: one per distribution, the best first of `tags`.

    Raises `PayloadRefused`: WHEEL_INCOMPATIBLE says what is there and what would be needed,
    LOCK_INVALID which markers cannot be evaluated.
    """
    if problems := list(_not_evaluated(lock.parsed, environment, lock.where)):
        raise PayloadRefused(*problems)
    try:
        chosen = list(lock.parsed.select(environment=environment, tags=tags))  # type: ignore[arg-type]  # a Mapping of markers is what it reads
    except PylockSelectError as error:
        _refuse(
            Problem(
                "WHEEL_INCOMPATIBLE",
                str(error),
                where=lock.where,
                need=_needed(environment, tags),
                have=", ".join(sorted(_platforms(lock))) or "none",
                fix="build the payload for this architecture and Python",
            )
        )
    paths = {wheel.path: wheel for wheel in lock.wheels}
    return tuple(paths[str(wheel.path)] for _, wheel in chosen if hasattr(wheel, "path"))


def _not_evaluated(parsed: Pylock, environment: Environment, where: str) -> Iterator[Problem]:
    """What is wrong with the markers that cannot be evaluated on a host."""
    marked: list[tuple[str, Marker | None, EvaluateContext]] = [
        *(("environments", marker, "requirement") for marker in parsed.environments or ()),
        *((str(package.name), package.marker, "lock_file") for package in parsed.packages),
    ]
    for place, marker, context in marked:
        try:
            if marker is not None:
                marker.evaluate(environment, context)
        except (ValueError, RecursionError, UndefinedEnvironmentName):
            text = f"the marker {str(marker)[:200]!r} cannot be evaluated"
            yield _flaw("LOCK_INVALID", text, f"{where} {place}")


def flaws(package: Package, where: str) -> Iterator[Problem]:
    """What is wrong with a package, whatever of it the library has seen to already: not every
    version of it sees to the same."""
    name = str(package.name)
    for source in ("vcs", "directory", "archive", "sdist"):
        if getattr(package, source) is not None:
            yield _flaw("LOCK_NOT_WHEEL", f"{name} comes from a {source}, not a wheel", where)
    if package.index is not None:
        yield _flaw("LOCK_PATH", f"{name} is looked for in an index, not in the payload", where)
    if not package.wheels:
        yield _flaw("LOCK_NOT_WHEEL", f"{name} has no wheel", where)
    if package.version is None:
        yield _flaw("LOCK_INVALID", f"{name} has no version", where)
    if (flaw := _unpacked_flaw(package)) is not None:
        yield _flaw("LOCK_INVALID", f"{name}: {flaw}", where)
    for wheel in package.wheels or ():
        place = f"{where} {name}"
        if wheel.url is not None:
            yield _flaw("LOCK_PATH", f"{wheel.url!r} is an address, not a path", place)
        elif wheel.path is None:
            yield _flaw("LOCK_PATH", "a wheel has no path", place)
        elif flaw := names.path_flaw(wheel.path):
            yield _flaw("LOCK_PATH", f"path {wheel.path[:80]!r}: {flaw}", place)
        else:
            yield from _wheel_flaws(wheel.path, package, place)
        if wheel.name is not None and wheel.path and wheel.name != PurePosixPath(wheel.path).name:
            text = f"{wheel.path} is called {wheel.name[:80]!r}"
            yield _flaw("LOCK_INVALID", text, place)
        if not _SHA256.fullmatch(wheel.hashes.get("sha256", "")):
            yield _flaw("LOCK_HASH", f"{wheel.path} has no sha256 of 64 hex digits", place)
        if wheel.size is None:
            yield _flaw("LOCK_HASH", f"{wheel.path} has no size", place)


def _wheel_flaws(path: str, package: Package, place: str) -> Iterator[Problem]:
    try:
        name, version, _, _ = parse_wheel_filename(PurePosixPath(path).name)
    except InvalidWheelFilename as error:
        yield _flaw("LOCK_NOT_WHEEL", str(error), place)
        return
    if name != canonicalize_name(package.name) or version != package.version:
        yield _flaw("LOCK_INVALID", f"{path} is not {package.name} {package.version}", place)


def _unpacked(package: Package) -> Any:
    """What the lock says of its wheels' unpacked sizes, in the table that tools have to themselves
    (PEP 751, `packages.tool`)."""
    table = (package.tool or {}).get(TOOL, {})
    return table.get(UNPACKED, {}) if isinstance(table, dict) else table


def _unpacked_flaw(package: Package) -> str | None:
    said = _unpacked(package)
    if not isinstance(said, dict) or not all(type(size) is int for size in said.values()):
        return f"{UNPACKED!r} of the tool {TOOL!r} must say how many bytes each wheel unpacks to"
    if any(not 0 <= size <= MAX_FILE_BYTES for size in said.values()):
        return f"a wheel that unpacks to other than 0 to {MAX_FILE_BYTES} bytes"
    return None


def _wheels(parsed: Pylock) -> Iterator[LockedWheel]:
    for package in parsed.packages:
        unpacked = _unpacked(package)
        for wheel in package.wheels or ():
            yield LockedWheel(
                name=str(package.name),
                version=str(package.version),
                path=str(wheel.path),
                sha256=wheel.hashes["sha256"],
                size=int(wheel.size or 0),
                unpacked=unpacked.get(PurePosixPath(wheel.path or "").name, int(wheel.size or 0)),
            )


def _needed(environment: Environment, tags: Sequence[Tag]) -> str:
    """What a host takes, in words; the first tag tells its libc best."""
    platform = next((tag.platform for tag in tags if tag.platform != "any"), "any")
    return (
        f"wheels for {environment['platform_machine']}, Python {environment['python_version']}, "
        f"{platform} or older"
    )


def _platforms(lock: Lock) -> set[str]:
    return {
        f"{tag.interpreter} on {tag.platform}"
        for wheel in lock.wheels
        for tag in wheel.tags
        if tag.platform != "any"
    }


def _flaw(code: str, message: str, where: str) -> Problem:
    return Problem(code, message, where=where, fix="build the payload again")


def _refuse(problem: Problem) -> NoReturn:
    raise PayloadRefused(problem)
