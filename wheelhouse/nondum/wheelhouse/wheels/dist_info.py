"""The `.dist-info` folder of a wheel: METADATA, WHEEL and entry points, held to the file's name.

What is installed goes by these files, what is chosen by the name: if they differ, a wheel could be
chosen as one thing and be another. ("Core metadata", "Binary distribution format" and "Entry
points" of the PyPA.)
"""

from __future__ import annotations

import configparser
import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from email.message import Message
from email.parser import HeaderParser
from pathlib import PurePosixPath

from packaging.requirements import Requirement
from packaging.specifiers import InvalidSpecifier, SpecifierSet
from packaging.tags import Tag, parse_tag
from packaging.utils import canonicalize_name, parse_wheel_filename
from packaging.version import InvalidVersion, Version

from nondum.sdk.frozen import frozen

MAX_METADATA = 4 * 1024**2
MAX_WHEEL = 64 * 1024
MAX_ENTRY_POINTS = 256 * 1024
MAX_HEADERS = 512 * 1024
"""Characters of METADATA before its text begins: reading headers takes long. boto3-stubs, with 882
dependencies, has 81,000 of them."""
MAX_LINES = 10_000
"""Lines of the same."""
MAX_REQUIREMENTS = 256 * 1024
"""Characters of all dependencies together."""
MAX_REQUIREMENT = 2000
"""Characters of one."""
MAX_TOLD = 10
"""Dependencies that are told when they are wrong."""
MAX_TEXT = 250
"""Characters of a version, a specifier or a tag."""
MAX_TAGS = 1000
OWN_GROUPS = "nondum."
"""Groups of entry points that are read here begin so."""

_END_OF_HEADERS = re.compile(r"\n\r?\n")
_OBJECT = re.compile(r"[\w.]+(\s*:\s*[\w.]+)?(\s*\[[^\]]*\])?")
_PLATFORM = re.compile(r"(?:linux|manylinux\d+|(?:many|musl)linux_\d+_\d+)_(\w+)")
_WHEEL_VERSION = re.compile(r"1\.\d{1,4}")


@frozen
class WheelName:
    """What a wheel's file name says."""

    name: str
    """Normalised."""
    version: Version
    tags: frozenset[Tag]

    @classmethod
    def parse(cls, filename: str) -> WheelName:
        """Raises `InvalidWheelFilename`."""
        name, version, _, tags = parse_wheel_filename(filename)
        return cls(str(name), version, tags)

    @property
    def architectures(self) -> frozenset[str]:
        """The Linux machines that it is for, as `uname -m` says; empty: it runs on any."""
        platforms = {tag.platform for tag in self.tags}
        if "any" in platforms:
            return frozenset()
        return frozenset(found[1] for name in platforms if (found := _PLATFORM.fullmatch(name)))

    def is_folder(self, folder: str, suffix: str) -> bool:
        """Whether `folder` is this wheel's `<name>-<version><suffix>`, however it is written."""
        name, _, version = folder.removesuffix(suffix).rpartition("-")
        same_name = canonicalize_name(name) == self.name
        return (
            folder.endswith(suffix) and same_name and _is(version.replace("_", "-"), self.version)
        )


@frozen
class Needs:
    """What a distribution needs, by its METADATA."""

    requirements: tuple[str, ...] = ()
    """`Requires-Dist` lines."""
    python: str = ""
    """`Requires-Python`; empty: any."""


def folder(paths: Sequence[str], named: WheelName) -> str:
    """The one `.dist-info` folder. Raises `ValueError` when it is missing, or another is there.

    Vendored ones, deeper down, do not count.
    """
    tops = {PurePosixPath(path).parts[0] for path in paths}
    found = sorted(top for top in tops if top.endswith((".dist-info", ".egg-info", ".egg-link")))
    own = [top for top in found if named.is_folder(top, ".dist-info")]
    if len(own) != 1 or f"{own[0]}/WHEEL" not in paths:
        raise ValueError(f"has no .dist-info folder of {named.name} {named.version}")
    if others := [top for top in found if top not in own]:
        raise ValueError(f"has {others[0]!r}, which speaks for another distribution")
    return own[0]


def metadata_flaws(text: str, named: WheelName) -> Iterator[str]:
    """What is wrong with METADATA."""
    headers = _headers_of(text)
    if len(headers) > MAX_HEADERS or headers.count("\n") > MAX_LINES:
        yield "METADATA has headers without end"
        return
    said = _parsed(headers)
    names, versions = said.get_all("Name", []), said.get_all("Version", [])
    if [canonicalize_name(str(name)) for name in names] != [named.name]:
        yield f"METADATA is of {', '.join(map(str, names))[:80] or 'no name'!r}, not {named.name!r}"
    if len(versions) != 1 or not _is(str(versions[0]), named.version):
        told = ", ".join(map(str, versions))[:80]
        yield f"METADATA is of version {told!r}, not {named.version}"
    needed = _needs(said)
    if sum(map(len, needed.requirements)) > MAX_REQUIREMENTS:
        yield "METADATA has dependencies without end"
        return
    yield from itertools.islice(_requirement_flaws(needed.requirements), MAX_TOLD)
    if not _is_specifier(needed.python):
        yield f"Requires-Python {needed.python[:80]!r} is no version specifier"


def needs(text: str) -> Needs:
    """What METADATA without flaws asks for."""
    return _needs(_parsed(_headers_of(text)))


def _needs(said: Message) -> Needs:
    requirements = tuple(str(line) for line in said.get_all("Requires-Dist", []))
    return Needs(requirements, str(said.get("Requires-Python", "")).strip())


def _headers_of(text: str) -> str:
    """The text before the first empty line; no reader takes what follows for headers."""
    end = _END_OF_HEADERS.search(text)
    return text[: end.start() + 1] if end else text


def wheel_flaws(text: str, named: WheelName) -> Iterator[str]:
    """What is wrong with WHEEL."""
    said = _parsed(text)
    version = str(said.get("Wheel-Version", "")).strip()
    if not _WHEEL_VERSION.fullmatch(version):
        yield f"WHEEL is of format {version[:40]!r}, expected '1.x'"
    purelib = str(said.get("Root-Is-Purelib", "")).strip().lower()
    if purelib not in ("true", "false"):
        yield f"Root-Is-Purelib is {purelib[:40]!r}, neither true nor false"
    lines = [str(line).strip() for line in said.get_all("Tag", [])]
    try:
        if len(lines) > MAX_TAGS or any(len(line) > MAX_TEXT for line in lines):
            raise ValueError("they would take long to be told apart")
        tags = frozenset(tag for line in lines for tag in parse_tag(line))
    except ValueError:
        yield "a Tag in WHEEL is none"
        return
    if tags and not {_machine(tag) for tag in named.tags} <= {_machine(tag) for tag in tags}:
        yield f"its name says that it is for {_shown(named.tags)}, WHEEL says {_shown(tags)}"


def entry_point_flaws(text: str) -> Iterator[str]:
    """What is wrong with entry_points.txt."""
    parser = configparser.ConfigParser(delimiters=("=",), interpolation=None)
    parser.optionxform = str  # type: ignore[assignment,method-assign]  # names keep their case
    try:
        parser.read_string(text)
    except configparser.Error as error:
        yield f"entry_points.txt cannot be read ({' '.join(str(error).split())[:120]})"
        return
    for group in parser.sections():
        if group.startswith(OWN_GROUPS):
            yield from _object_flaws(group, parser[group])


def _object_flaws(group: str, entries: Mapping[str, str]) -> Iterator[str]:
    for name, value in entries.items():
        if not _OBJECT.fullmatch(value.strip()):
            yield f"entry point {name[:40]!r} of {group} names no object: {value[:60]!r}"


def _requirement_flaws(lines: Iterable[str]) -> Iterator[str]:
    for line in lines:
        if flaw := _requirement_flaw(line):
            yield f"the dependency {line[:80]!r} {flaw}"


def _requirement_flaw(line: str) -> str | None:
    if len(line) > MAX_REQUIREMENT:
        return "is too long"
    try:
        wanted = Requirement(line)
    except (ValueError, RecursionError):  # InvalidRequirement among them
        return "cannot be read"
    return "is an address, not a version" if wanted.url else None


def _parsed(text: str) -> Message:
    return HeaderParser().parsestr(text)


def _is(told: str, version: Version) -> bool:
    try:
        return len(told) <= MAX_TEXT and Version(told.strip()) == version
    except InvalidVersion:
        return False


def _is_specifier(told: str) -> bool:
    if len(told) > MAX_TEXT:
        return False
    try:
        SpecifierSet(told)
    except InvalidSpecifier:
        return False
    return True


def _machine(tag: Tag) -> tuple[str, str, bool]:
    """What a tag runs on, but for the age of its libc: repairing a wheel changes that alone."""
    found = _PLATFORM.fullmatch(tag.platform)
    architecture = found[1] if found else tag.platform
    return tag.interpreter, architecture, tag.platform.startswith("musl")


def _shown(tags: frozenset[Tag]) -> str:
    told = sorted(map(str, tags))
    return ", ".join(told[:3]) + (" …" if len(told) > 3 else "") if told else "nothing"
