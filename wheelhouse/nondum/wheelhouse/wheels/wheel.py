"""What may be inside a wheel, and where its files go.

Installed are purelib and platlib (both become site-packages). Other data schemes are left out:
nothing from a venv is run but by its worker, so scripts have no use. Specified in
"Binary distribution format" (PyPA); what is refused beyond it keeps a payload from acting before,
beside or instead of its worker.
"""

from __future__ import annotations

import hashlib
import sys
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path, PurePosixPath

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.fixed_file import Bytes, FixedFile
from nondum.wheelhouse.wheels import archive, dist_info, extensions, record
from nondum.wheelhouse.wheels.archive import Member
from nondum.wheelhouse.wheels.dist_info import Needs, WheelName
from nondum.wheelhouse.wheels.record import Record

SDK = "nondum-sdk"
HARMLESS_HOOKS = frozenset({"distutils-precedence.pth", "a1_coverage.pth"})
"""Start-up hooks of well-known tools: left out, since workers run no hooks, and not refused."""
STARTUP_MODULES = frozenset({"sitecustomize", "usercustomize"})
INTERPRETER_NAMES = ("python", "pip", "activate")
LIBRARY_SCHEMES = ("purelib", "platlib")
SCHEMES = (*LIBRARY_SCHEMES, "scripts", "headers", "data")
ENTRY_POINTS = "entry_points.txt"


@frozen
class PlannedFile:
    """A file of a wheel, and where in site-packages it goes."""

    target: str
    member: Member
    sha256: str
    """Hex digest that RECORD gives; empty for the few files that it gives none for."""
    contents: bytes | None = None
    """What is written instead of the member's bytes, if RECORD has to name other files."""

    @property
    def size(self) -> int:
        """Bytes of the file that is written."""
        return self.member.size if self.contents is None else len(self.contents)


@frozen
class Layout:
    """How a wheel is laid out in site-packages."""

    files: tuple[PlannedFile, ...]
    left_out: tuple[str, ...]
    """Members that are not installed: scripts, headers, data."""
    problems: tuple[Problem, ...]
    needs: Needs = field(default_factory=Needs)
    """What its metadata asks for."""

    @property
    def size(self) -> int:
        """Bytes of all files that are installed."""
        return sum(file.size for file in self.files)


def opened(path: Path) -> FixedFile:
    """A wheel's bytes; close it. Only for files that no one else can change. Raises `OSError`."""
    return FixedFile(path)


def lay_out(data: Bytes, filename: str) -> Layout:
    """Judge a wheel but for its files' contents, and say where they go.

    Start-up hooks are left out; `hook_problems` judges those.
    """
    found = archive.read(data, filename)
    if found.problems:
        return Layout((), (), found.problems)
    try:
        named = WheelName.parse(filename)
        info = dist_info.folder([_target(m.path) or m.path for m in found.members], named)
    except ValueError as error:  # InvalidWheelFilename among them
        return Layout((), (), (Problem("WHEEL_STRUCTURE", str(error), where=filename),))
    by_path = {member.path: member for member in found.members}
    try:
        listed = record.parse(read_text(data, by_path, f"{info}/RECORD", record.MAX_BYTES))
    except ValueError as error:
        text = f"RECORD is missing or cannot be read ({error})"
        return Layout((), (), (Problem("WHEEL_RECORD", text, where=filename),))
    needs, metadata_flaws = _described(data, by_path, info, named)
    problems = [
        *_problems("WHEEL_RECORD", record.flaws(found.members, listed, info), filename),
        *_problems("WHEEL_METADATA", metadata_flaws, filename),
        *_problems("WHEEL_DATA_SCHEME", _scheme_flaws(found.members, named), filename),
        *_content_problems(found.members, named.name, filename),
    ]
    files, left_out = [], []
    for member in found.members:
        target = _target(member.path)
        if target is None or is_hook(target):
            left_out.append(member.path)
        else:
            row = listed.get(member.path)
            files.append(PlannedFile(target, member, row.sha256 if row else ""))
    problems.extend(_target_problems(files, filename))
    placed = [(file.target, file.member) for file in files]
    problems.extend(extensions.problems(data, placed, named, filename))
    planned = _with_record(files, listed, f"{info}/RECORD")
    return Layout(planned, tuple(left_out), tuple(problems), needs)


def _with_record(
    files: Sequence[PlannedFile], listed: Record, record_path: str
) -> tuple[PlannedFile, ...]:
    """The files, with a RECORD that names these and no others: pip and `importlib.metadata` read
    what it says."""
    places = {file.member.path: file.target for file in files}
    if all(places.get(path) == path for path in listed):
        return tuple(files)
    told = record.as_installed(listed, places).encode()
    return tuple(
        replace(file, contents=told) if file.member.path == record_path else file for file in files
    )


def hook_problems(
    left_out: Iterable[str], filename: str, allowed: Collection[str] = ()
) -> tuple[Problem, ...]:
    """Start-up hooks among what is left out of a wheel, but for those that the manifest names.

    None is ever installed, since workers run no hooks; but a wheel that counts on one would not
    work, and an unexpected one is most often an attack.
    """
    hooks = [target for path in left_out if is_hook(target := _target(path) or "")]
    return tuple(
        Problem(
            "WHEEL_STARTUP_HOOK",
            f"{hook!r} would run when an interpreter starts",
            where=filename,
            fix=f'if it is harmless to do without it, put startup_hooks = ["{hook}"] in '
            "payload.toml, and build the payload again",
        )
        for hook in hooks
        if hook not in HARMLESS_HOOKS and hook not in allowed
    )


def check(path: Path, allowed_hooks: Collection[str] = ()) -> tuple[Problem, ...]:
    """Everything wrong with a wheel, its files' contents included."""
    with opened(path) as data:
        layout = lay_out(data, path.name)
        hooks = hook_problems(layout.left_out, path.name, allowed_hooks)
        return (*layout.problems, *hooks, *_damaged(data, layout, path.name))


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


def _described(
    data: Bytes, by_path: Mapping[str, Member], info: str, named: WheelName
) -> tuple[Needs, list[str]]:
    """What the wheel's metadata asks for, and what is wrong in it."""
    flaws: list[str] = []

    def text_of(name: str, limit: int) -> str | None:
        try:
            return read_text(data, by_path, f"{info}/{name}", limit)
        except ValueError as error:
            flaws.append(f"{name} is missing or cannot be read ({error})")
            return None

    if (metadata := text_of("METADATA", dist_info.MAX_METADATA)) is not None:
        flaws += dist_info.metadata_flaws(metadata, named)
    if (wheel := text_of("WHEEL", dist_info.MAX_WHEEL)) is not None:
        flaws += dist_info.wheel_flaws(wheel, named)
    has_entry_points = f"{info}/{ENTRY_POINTS}" in by_path
    if has_entry_points and (text := text_of(ENTRY_POINTS, dist_info.MAX_ENTRY_POINTS)) is not None:
        flaws += dist_info.entry_point_flaws(text)
    return dist_info.needs(metadata or "") if not flaws else Needs(), flaws


def read_text(data: Bytes, by_path: Mapping[str, Member], path: str, limit: int) -> str:
    """A member as text. Raises `ValueError` when it is missing, too long, damaged or not UTF-8."""
    member = by_path.get(path)
    if member is None:
        raise ValueError("it is not there")
    if member.size > limit:
        raise ValueError(f"it is longer than {limit} bytes")
    return b"".join(archive.unpack(data, member)).decode()


def _problems(code: str, flaws: Iterable[str], filename: str) -> Iterator[Problem]:
    return (Problem(code, flaw, where=filename) for flaw in flaws)


def _scheme_flaws(members: Sequence[Member], named: WheelName) -> Iterator[str]:
    for member in members:
        top, _, rest = member.path.partition("/")
        if not rest or not top.endswith(".data"):
            continue
        scheme, _, inside = rest.partition("/")
        leaf = PurePosixPath(member.path).name.lower()
        if not named.is_folder(top, ".data"):
            yield f"member {member.path!r} is in the data folder of another distribution"
        elif scheme not in SCHEMES or not inside:
            yield f"member {member.path!r} is in no known part of a data folder"
        elif scheme not in LIBRARY_SCHEMES and leaf.startswith(INTERPRETER_NAMES):
            yield f"member {member.path!r} would stand in for the interpreter or pip"


def _content_problems(members: tuple[Member, ...], name: str, filename: str) -> Iterator[Problem]:
    tops = set()
    for member in members:
        target = _target(member.path)
        if target is None:
            continue
        top, _, rest = target.partition("/")
        module = top.split(".")[0] if not rest or top.endswith(".py") else top
        tops.add(module)
        if module == "nondum" and not (name == SDK and target.startswith("nondum/sdk/")):
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


def is_hook(target: str) -> bool:
    """Whether `site` would act by a file of site-packages (PEP 829 adds `.start` to `.pth`)."""
    return "/" not in target and target.endswith((".pth", ".start"))


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
