"""What may be inside a wheel, and where its files go.

Installed are purelib and platlib (both become site-packages). Other data schemes are left out:
nothing from a venv is run but by its worker, so scripts have no use. Specified in
"Binary distribution format" (PyPA); what is refused beyond it keeps a payload from acting before,
beside or instead of its worker.
"""

from __future__ import annotations

import base64
import binascii
import csv
import hashlib
import io
import mmap
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from email.parser import HeaderParser
from pathlib import Path, PurePosixPath

from packaging.utils import InvalidWheelFilename, parse_wheel_filename
from packaging.version import InvalidVersion, Version

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse import archive
from nondum.wheelhouse.archive import Bytes, Member

SDK = "nondum-sdk"
HARMLESS_HOOKS = frozenset({"distutils-precedence.pth", "a1_coverage.pth"})
"""Start-up hooks of well-known tools: left out, since workers run no hooks, and not refused."""
STARTUP_MODULES = frozenset({"sitecustomize", "usercustomize"})
INTERPRETER_NAMES = ("python", "pip", "activate")
LIBRARY_SCHEMES = ("purelib", "platlib")
MAX_METADATA_BYTES = 16 * 1024**2


@dataclass(frozen=True, slots=True)
class PlannedFile:
    """A file of a wheel, and where in site-packages it goes."""

    target: str
    member: Member
    sha256: str
    """Hex digest that RECORD gives; empty for the few files that it gives none for."""


@dataclass(frozen=True, slots=True)
class Layout:
    """How a wheel is laid out in site-packages."""

    files: tuple[PlannedFile, ...]
    left_out: tuple[str, ...]
    """Members that are not installed: scripts, headers, data."""
    problems: tuple[Problem, ...]


@contextmanager
def opened(path: Path) -> Iterator[Bytes]:
    """A wheel's bytes, mapped read-only. Only for files that nobody else can change."""
    with path.open("rb") as file:
        if not path.stat().st_size:
            yield memoryview(b"")
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
            view = memoryview(mapped)
            try:
                yield view
            finally:
                view.release()


def lay_out(data: Bytes, filename: str) -> Layout:
    """Judge a wheel but for its files' contents, and say where they go."""
    found = archive.read(data, filename)
    if found.problems:
        return Layout((), (), found.problems)
    try:
        name, version, _, _ = parse_wheel_filename(filename)
    except InvalidWheelFilename as error:
        return Layout((), (), (Problem("WHEEL_STRUCTURE", str(error), where=filename),))
    info = _dist_info(found.members, str(name), str(version))
    if info is None:
        text = f"has no .dist-info folder of {name} {version}"
        return Layout((), (), (Problem("WHEEL_STRUCTURE", text, where=filename),))
    try:
        record = _record(data, found.members, info)
    except (ValueError, csv.Error, KeyError) as error:
        text = f"RECORD is missing or cannot be read ({error})"
        return Layout((), (), (Problem("WHEEL_RECORD", text, where=filename),))
    problems = [
        *_record_problems(found.members, record, info, filename),
        *_content_problems(found.members, str(name), filename),
    ]
    files, left_out = [], []
    for member in found.members:
        target = _target(member.path)
        if target is None or target in HARMLESS_HOOKS:
            left_out.append(member.path)
        else:
            files.append(PlannedFile(target, member, record.get(member.path, "")))
    problems.extend(_target_problems(files, filename))
    return Layout(tuple(files), tuple(left_out), tuple(problems))


def check(path: Path) -> tuple[Problem, ...]:
    """Everything wrong with a wheel, its files' contents included."""
    with opened(path) as data:
        layout = lay_out(data, path.name)
        return (*layout.problems, *_damaged(data, layout, path.name))


def requirements(data: Bytes, layout: Layout) -> tuple[str, ...]:
    """The `Requires-Dist` lines of a wheel that was laid out without problems."""
    for file in layout.files:
        if file.target.count("/") == 1 and file.target.endswith(".dist-info/METADATA"):
            metadata = HeaderParser().parsestr(read_text(data, file.member))
            return tuple(str(line) for line in metadata.get_all("Requires-Dist", ()))
    return ()


def _damaged(data: Bytes, layout: Layout, filename: str) -> Iterator[Problem]:
    for file in layout.files:
        digest = hashlib.sha256()
        try:
            for piece in archive.unpack(data, file.member):
                digest.update(piece)
        except ValueError as error:
            yield damaged(file, filename, str(error))
            continue
        if file.sha256 and digest.hexdigest() != file.sha256:
            yield damaged(file, filename, "it is not what RECORD says")


def damaged(file: PlannedFile, filename: str, why: str) -> Problem:
    """A member whose contents are not what they must be."""
    return Problem(
        "WHEEL_RECORD", f"member {file.member.path!r}: {why}", where=filename, fix="build it again"
    )


def refuse_if_any(problems: tuple[Problem, ...]) -> None:
    """Raise `PayloadRefused` when there are problems."""
    if problems:
        raise PayloadRefused(*problems)


def _dist_info(members: tuple[Member, ...], name: str, version: str) -> str | None:
    marks = [PurePosixPath(m.path) for m in members if m.path.endswith(".dist-info/WHEEL")]
    folders = {str(mark.parent) for mark in marks if len(mark.parts) == 2}  # not vendored ones
    wanted = f"{name.replace('-', '_')}-{version}.dist-info"
    for folder in folders:
        stem = folder.removesuffix(".dist-info")
        found_name, _, found_version = stem.rpartition("-")
        same_name = found_name.lower().replace("-", "_").replace(".", "_") == name.replace("-", "_")
        if folder == wanted or (same_name and _same_version(found_version, version)):
            return folder if len(folders) == 1 else None
    return None


def _same_version(one: str, other: str) -> bool:
    try:
        return Version(one.replace("_", "-")) == Version(other)
    except InvalidVersion:
        return False


def _record(data: Bytes, members: tuple[Member, ...], info: str) -> dict[str, str]:
    by_path = {member.path: member for member in members}
    text = read_text(data, by_path[f"{info}/RECORD"])
    record: dict[str, str] = {}
    for row in csv.reader(io.StringIO(text)):
        if not row:
            continue
        if len(row) != 3:
            raise ValueError(f"row {','.join(row)[:60]!r} has not three columns")
        path, digest, _ = row
        if path in record:
            raise ValueError(f"{path!r} stands twice")
        record[path] = _hex(digest)
    return record


def _hex(digest: str) -> str:
    """RECORD's `sha256=<urlsafe base64>` as hex; empty when it gives none."""
    if not digest:
        return ""
    method, _, value = digest.partition("=")
    if method != "sha256":
        raise ValueError(f"digest by {method[:20]!r}, not sha256")
    try:
        return base64.urlsafe_b64decode(value + "=" * (-len(value) % 4)).hex()
    except binascii.Error as error:
        raise ValueError(f"digest {value[:20]!r} is no base64") from error


def read_text(data: Bytes, member: Member) -> str:
    """A member as text. Raises `ValueError` when it is too long, damaged or not UTF-8."""
    if member.size > MAX_METADATA_BYTES:
        raise ValueError(f"{member.path} is longer than {MAX_METADATA_BYTES} bytes")
    return b"".join(archive.unpack(data, member)).decode()


def _record_problems(
    members: tuple[Member, ...], record: dict[str, str], info: str, filename: str
) -> Iterator[Problem]:
    may_lack_digest = {f"{info}/RECORD", f"{info}/RECORD.jws", f"{info}/RECORD.p7s"}
    for member in members:
        if member.path not in record and member.path not in may_lack_digest:
            text = f"member {member.path!r} is not in RECORD"
            yield Problem("WHEEL_RECORD", text, where=filename)
        elif not record.get(member.path) and member.path not in may_lack_digest:
            text = f"member {member.path!r} has no digest in RECORD"
            yield Problem("WHEEL_RECORD", text, where=filename)
    for path in record.keys() - {member.path for member in members} - may_lack_digest:
        yield Problem("WHEEL_RECORD", f"RECORD lists {path!r}, which is not there", where=filename)


def _content_problems(members: tuple[Member, ...], name: str, filename: str) -> Iterator[Problem]:
    tops = set()
    for member in members:
        target = _target(member.path)
        if target is None:
            leaf = PurePosixPath(member.path).name.lower()
            if leaf.startswith(INTERPRETER_NAMES):
                text = f"member {member.path!r} would stand in for the interpreter or pip"
                yield Problem("WHEEL_DATA_SCHEME", text, where=filename)
            continue
        top, _, rest = target.partition("/")
        tops.add(top.split(".")[0] if not rest or top.endswith(".py") else top)
        if top.endswith(".pth") and not rest and top not in HARMLESS_HOOKS:
            text = f"{target!r} would run when an interpreter starts"
            yield Problem("WHEEL_STARTUP_HOOK", text, where=filename)
        if top == "nondum" and not (name == SDK and target.startswith("nondum/sdk/")):
            text = f"{target!r} lies in nondum's own namespace"
            yield Problem("WHEEL_SHADOWS", text, where=filename)
    for hook in sorted(tops & STARTUP_MODULES):
        text = f"{hook!r} would run when an interpreter starts"
        yield Problem("WHEEL_STARTUP_HOOK", text, where=filename)
    for module in sorted(tops & sys.stdlib_module_names - {"__pycache__"}):
        text = f"{module!r} would shadow the standard library"
        yield Problem("WHEEL_SHADOWS", text, where=filename)


def _target_problems(files: Sequence[PlannedFile], filename: str) -> Iterator[Problem]:
    """Two files in one place: of two schemes, or one where another needs a folder."""
    targets = Counter(file.target for file in files)
    folders: set[str] = set()
    for target in targets:
        parent = target.rpartition("/")[0]
        while parent and parent not in folders:  # those above a known one are known
            folders.add(parent)
            parent = parent.rpartition("/")[0]
    for target, count in targets.items():
        if count > 1 or target in folders:
            text = f"{target!r} would be two things at once"
            yield Problem("WHEEL_PATH", text, where=filename)


def _target(path: str) -> str | None:
    """Where in site-packages a member goes, or None when it does not.

    >>> _target("a/b.py"), _target("a-1.data/purelib/a/c.py"), _target("a-1.data/scripts/a")
    ('a/b.py', 'a/c.py', None)
    """
    top, _, rest = path.partition("/")
    if not top.endswith(".data"):
        return path
    scheme, _, target = rest.partition("/")
    return (target or None) if scheme in LIBRARY_SCHEMES else None
