"""A payload as a whole: its parts parsed and held against one another, and its wheels judged.

`load` is for a staged copy, whose files are what its contents list says.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

from nondum.sdk.description import DeviceNeed, PluginDescription
from nondum.sdk.errors import NondumError, PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import data, goals, index, lock, manifest, tables
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.format.index import Index
from nondum.wheelhouse.format.lock import Lock, LockedWheel
from nondum.wheelhouse.format.manifest import ComponentManifest, Manifest
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.preflight import misfits, select, unmet, unpacked_problems
from nondum.wheelhouse.wheels import wheel
from nondum.wheelhouse.wheels.wheel import Layout

_T = TypeVar("_T")

MAX_METADATA = 16 * 1024 * 1024
"""Bytes of all files together that a payload is judged by."""


@frozen
class StagedPayload:
    """A payload whose files are in staging and were checked against its contents list."""

    folder: Path
    contents: Contents
    manifest: Manifest
    locks: Mapping[str, Lock]
    index: Index
    goals: tuple[str, ...] = ()
    """What it wants, in words."""

    @property
    def data_files(self) -> tuple[Entry, ...]:
        """The files of all data that it brings."""
        return tuple(entry for entry in self.contents.entries if is_data(entry.path))

    def wheels(self, facts: HostFacts) -> dict[str, tuple[LockedWheel, ...]]:
        """The wheels of each component on such a host. Raises `PayloadRefused`."""
        return select(self.manifest, self.locks, facts)


def load(folder: Path, listed: Contents) -> StagedPayload:
    """Parse a staged payload. Raises `PayloadRefused` with the problems of all its parts."""
    problems: list[Problem] = []
    brings_goals = any(entry.path == goals.NAME for entry in listed.entries)
    wanted = _part(problems, partial(_goals, folder)) if brings_goals else ()
    said = _part(problems, partial(_manifest, folder, brings_goals=brings_goals))
    described = _part(problems, lambda: index.parse(_bytes(folder, index.NAME), index.NAME))
    locks = {}
    for component in said.components if said else ():
        if parsed := _part(problems, partial(_lock, folder, lock.file_name(component.id))):
            locks[component.id] = parsed
    if problems:
        raise PayloadRefused(*problems)
    assert said is not None and described is not None and wanted is not None  # else that was told
    if disagreements := tuple(_disagreements(listed, said, locks, described)):
        raise PayloadRefused(*disagreements)
    return StagedPayload(folder, listed, said, locks, described, wanted)


def is_metadata(path: str) -> bool:
    """Whether a listed file is needed to judge the payload, rather than a wheel or data."""
    return not (path.startswith("wheels/") or is_data(path))


def is_data(path: str) -> bool:
    """Whether a listed file is of some `[[data]]`."""
    return path.startswith(f"{data.FOLDER}/")


def oversized(listed: Contents) -> Iterator[Problem]:
    """Metadata that is longer than anybody reads, by the sizes that are listed."""
    found = [entry for entry in listed.entries if is_metadata(entry.path)]
    for entry in found:
        most = _most_bytes(entry.path)
        if entry.size > most:
            yield _too_large(entry.path, most, entry.size)
    total = sum(entry.size for entry in found)
    if total > MAX_METADATA:
        yield _too_large("everything but wheels and data together", MAX_METADATA, total)


def _most_bytes(path: str) -> int:
    if path == manifest.NAME:
        return tables.MAX_BYTES
    if path == goals.NAME:
        return goals.MAX_BYTES
    if path == index.NAME:
        return index.MAX_BYTES
    return lock.MAX_BYTES if path.startswith("pylock.") else MAX_METADATA


def _too_large(what: str, most: int, size: int) -> Problem:
    text, fix = "is too long", "bring models and maps as `[[data]]`, and say less about them"
    return Problem("TOO_LARGE", text, what, f"at most {most} bytes", f"{size} bytes", fix)


def check_wheels(
    payload: StagedPayload, facts: HostFacts, stored: Mapping[str, Layout] = MappingProxyType({})
) -> tuple[Problem, ...]:
    """What is wrong with the wheels that such a host would install, but for their contents,
    which are checked as they are unpacked.

    `stored` are wheels, by hash, that are in the host's store already and need not be staged.
    """
    problems: list[Problem] = []
    layouts: dict[str, Layout] = {}
    for component, chosen in payload.wheels(facts).items():
        for locked in chosen:
            if locked.sha256 not in layouts:
                layout = _layout(payload.folder / locked.path, stored.get(locked.sha256))
                problems.extend(layout.problems)
                problems.extend(misfits(layout, locked.filename, payload.manifest, facts))
                layouts[locked.sha256] = layout
        requirements = {w.name: layouts[w.sha256].needs.requirements for w in chosen}
        problems.extend(unmet(requirements, chosen, facts, lock.file_name(component)))
    problems.extend(unpacked_problems(layouts.values(), facts, payload.manifest.id))
    return tuple(problems)


def device_problems(payload: StagedPayload) -> Iterator[Problem]:
    """Where a plugin asks for other devices than the manifest, by which they are given out."""
    for component in payload.manifest.components:
        yield from disagreeing_devices(component, payload.index[component.id])


def disagreeing_devices(component: ComponentManifest, said: PluginDescription) -> Iterator[Problem]:
    """Where a plugin's `devices()` is not what a component's table of the manifest says."""
    asked = {need.name: need for need in component.devices}
    answered = {need.name: need for need in said.devices}
    for name in sorted(asked.keys() | answered.keys()):
        if asked.get(name) != answered.get(name):
            yield Problem(
                "DEVICE_RULES",
                f"device {name!r} is not the same in devices() and in the manifest",
                where=component.id,
                need=_rules(asked.get(name), manifest.NAME),
                have=_rules(answered.get(name), "devices()"),
                fix=f"say the same in {manifest.NAME}, by which devices are given out",
            )


def _rules(need: DeviceNeed | None, where: str) -> str:
    if need is None:
        return f"no such device in {where}"
    rules = ", ".join(f'{key} = "{pattern}"' for key, pattern in need.match.items())
    return f"{{ {rules} }}{', optional' if need.optional else ''} in {where}"


def _layout(path: Path, stored: Layout | None) -> Layout:
    """A wheel's layout; of one that is not staged, what the store knows of it."""
    if stored is not None and not path.exists():
        return stored
    with wheel.opened(path) as data:
        return wheel.lay_out(data, path.name)


def _disagreements(
    listed: Contents, said: Manifest, locks: Mapping[str, Lock], described: Index
) -> Iterator[Problem]:
    """Where the parts of a payload contradict one another."""
    if said.id != listed.payload_id:
        text = f"id is {said.id!r}, the contents list says {listed.payload_id!r}"
        yield Problem("MANIFEST_VALUE", text, where=manifest.NAME)
    sizes = {entry.path: (entry.sha256, entry.size) for entry in listed.entries}
    for component, parsed in locks.items():
        for locked in parsed.wheels:
            if sizes.get(locked.path) != (locked.sha256, locked.size):
                text = f"{locked.path} is not in the contents list as the lock has it"
                yield Problem("LOCK_PATH", text, where=lock.file_name(component))
    yield from _disagreeing_data(sizes.keys(), said)
    ids = {component.id for component in said.components}
    for missing in sorted(ids - described.keys()):
        yield Problem("INDEX_INVALID", f"component {missing!r} is missing", where=index.NAME)
    for unknown in sorted(described.keys() - ids):
        text = f"component {unknown!r} is not in the manifest"
        yield Problem("INDEX_INVALID", text, where=index.NAME)


def _disagreeing_data(listed: Collection[str], said: Manifest) -> Iterator[Problem]:
    named = {path for brought in said.data for path in brought.paths}
    there = {path for path in listed if is_data(path)}
    for path in sorted(named - there):
        yield Problem("FILE_MISSING", "is data by the manifest, and not listed", where=path)
    for path in sorted(there - named):
        text = "is listed, and no [[data]] of the manifest names it"
        yield Problem("MANIFEST_VALUE", text, where=path, fix="name it in `files`, or leave it out")


def _part(problems: list[Problem], parse: Callable[[], _T]) -> _T | None:
    """What `parse` makes, or None with its problems noted."""
    try:
        return parse()
    except NondumError as error:
        problems.extend(error.problems)
        return None


def _manifest(folder: Path, *, brings_goals: bool) -> Manifest:
    return manifest.parse(_text(folder, manifest.NAME), manifest.NAME, brings_goals=brings_goals)


def _goals(folder: Path) -> tuple[str, ...]:
    return goals.parse(_bytes(folder, goals.NAME), goals.NAME)


def _lock(folder: Path, name: str) -> Lock:
    return lock.parse(_text(folder, name), name)


def _bytes(folder: Path, name: str) -> bytes:
    try:
        return (folder / name).read_bytes()
    except FileNotFoundError as error:
        problem = Problem(
            "FILE_MISSING", "is not in the payload", where=name, fix="build the payload again"
        )
        raise PayloadRefused(problem) from error


def _text(folder: Path, name: str) -> str:
    try:
        return _bytes(folder, name).decode()
    except UnicodeDecodeError as error:
        problem = Problem("NOT_UTF8", f"byte {error.start} is not UTF-8", where=name)
        raise PayloadRefused(problem) from error
