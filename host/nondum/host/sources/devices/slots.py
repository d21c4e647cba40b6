"""Device slots: folders of TOML files, each of which stands for a device (inotify(7)).

    [device]
    node = "/dev/pts/3"
    [device.properties]
    SUBSYSTEM = "tty"
    ID_MODEL = "PTU-D46-17"

A device of several nodes has `nodes = [{ node = "/dev/…", properties = {} }, …]` instead, and
perhaps `properties` that all of them have. A file appears: the device is plugged in. It goes: the
device is pulled. Files whose names begin with a dot, or end in anything but `.toml`, mean nothing.
"""

from __future__ import annotations

import contextlib
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from nondum.host.core.events.event import Emit
from nondum.host.core.records.device import DeviceNode, DeviceRecord
from nondum.host.sources.devices.hardware import described
from nondum.host.sources.devices.source import Sightings
from nondum.host.sources.inotify import folders_watched
from nondum.host.sources.slot_folders import (
    changed_or_due,
    is_gone,
    leads_nowhere,
    logged,
    unreadable,
)
from nondum.sdk.errors import ConfigRefused, Problem

MAX_BYTES = 64 * 1024


class DeviceSlotSource:
    """Watches folders of slot files; folders that are not there are made."""

    def __init__(self, folders: Sequence[Path]) -> None:
        self._folders = tuple(folders)
        self._refused: dict[Path, Problem] = {}
        self._unread: dict[Path, Problem] = {}
        """Folders and files that could not be read the last time."""
        self._seen: dict[Path, tuple[str, DeviceRecord]] = {}

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Of the files that stand for no device, and of what cannot be read."""
        return (*self._refused.values(), *self._unread.values())

    async def watch(self, emit: Emit) -> None:
        """Tell what is there, then what comes and goes (see `DeviceSource`)."""
        sightings = Sightings(emit)
        with folders_watched(self._folders) as changed:
            while True:
                changed.clear()
                self._seen = dict(self._present())
                sightings.see_all(dict(self._seen.values()))
                await changed_or_due(changed, is_unread=bool(self._unread))

    def _present(self) -> Iterator[tuple[Path, tuple[str, DeviceRecord]]]:
        refused: dict[Path, Problem] = {}
        unread: dict[Path, Problem] = {}
        for folder in self._folders:
            try:
                paths = _scanned(folder)
            except OSError as error:  # its devices may be in still
                kept = {path: one for path, one in self._seen.items() if path.parent == folder}
                unread[folder] = unreadable(folder, error, is_plugged_in=bool(kept))
                refused |= {p: told for p, told in self._refused.items() if p.parent == folder}
                yield from kept.items()
                continue
            for path in paths:
                name = path.stem if len(self._folders) == 1 else f"{folder.name}/{path.stem}"
                try:
                    yield path, (name, device_of(name, parse_slot(_read(path), str(path))))
                except ConfigRefused as wrong:
                    refused[path] = wrong.problems[0]
                except OSError as error:
                    if not is_gone(error):
                        is_known = path in self._seen
                        unread[path] = unreadable(path, error, is_plugged_in=is_known)
                        if is_known:
                            yield path, self._seen[path]
                        continue
                    with contextlib.suppress(OSError):  # it has just gone
                        refused[path] = leads_nowhere(path)
        self._refused = logged(self._refused, refused)
        self._unread = logged(self._unread, unread)


def _scanned(folder: Path) -> list[Path]:
    """The slot files in a folder, by name; one that was taken away has none. Raises `OSError`."""
    try:
        return sorted(
            path
            for path in folder.iterdir()
            if path.suffix == ".toml" and not path.name.startswith(".")
        )
    except (FileNotFoundError, NotADirectoryError):
        return []


def device_of(name: str, nodes: Sequence[DeviceNode]) -> DeviceRecord:
    """The device that a slot file stands for: it is what its nodes' properties say."""
    known = {key: value for node in reversed(nodes) for key, value in node.properties.items()}
    bus = known.get("ID_BUS", "")
    return DeviceRecord(name, tuple(nodes), bus=bus, port=name, **described(known))


def parse_slot(text: str, where: str) -> tuple[DeviceNode, ...]:
    """Read a slot file: the nodes of its device. Raises `ConfigRefused` (DEVICE_SLOT).

    >>> parse_slot('[device]\\nnode = "/dev/null"\\nproperties = { ID_BUS = "usb" }', "a.toml")
    (DeviceNode(node=PosixPath('/dev/null'), properties={'ID_BUS': 'usb'}, interface=''),)
    """
    try:
        data: dict[str, Any] = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # TOMLDecodeError, or a number without end
        raise _refused(where, str(error)) from error
    match data:
        case {"device": {"nodes": [_, *_] as nodes, **rest}, **others} if not others:
            shared = _properties(rest.pop("properties", {}), where)
            if rest:
                raise _refused(where, f"unknown key {next(iter(rest))!r}")
            return tuple(_node(node, shared, where) for node in nodes)
        case {"device": {"node": _, **_rest} as node, **others} if not others:
            return (_node(node, {}, where),)
    raise _refused(where, "there is one table, [device], with node or nodes, and properties")


def _node(said: Any, shared: Mapping[str, str], where: str) -> DeviceNode:
    match said:
        case {"node": str(node), **rest} if node:
            properties = _properties(rest.pop("properties", {}), where)
            if rest:
                raise _refused(where, f"unknown key {next(iter(rest))!r}")
            return DeviceNode(Path(node), {**shared, **properties})
    raise _refused(where, "each node is a table with node and properties")


def _properties(said: Any, where: str) -> dict[str, str]:
    if not isinstance(said, dict) or not all(isinstance(value, str) for value in said.values()):
        raise _refused(where, "properties are a table of strings")
    return said


def _read(path: Path) -> str:
    with open(path, "rb", opener=_without_waiting) as file:
        return file.read(MAX_BYTES).decode("utf-8", "replace")


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK)  # it may be a pipe


def _refused(where: str, message: str) -> ConfigRefused:
    example = '[device]\nnode = "/dev/…"\nproperties = { ID_MODEL = "…" }'.replace("\n", "; ")
    return ConfigRefused(Problem("DEVICE_SLOT", message, where=where, fix=f"write {example}"))
