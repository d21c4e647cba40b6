"""What a disk is sure to hold after each system call of a program: no more than was synced.

strace(1) records a program's calls. Replayed here, a file's bytes are on disk once the file was
synced, its name once the folder was, and either once the whole file system was: nothing else is,
however kind a real file system may be (fsync(2), syncfs(2)). What was renamed may be there at once,
and what it names may be empty still, if its bytes were not synced before.

A traced program says what must hold by `promise`.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

SYNCS = ("fsync", "fdatasync", "syncfs")
_WRITES = (
    *("write", "writev", "pwrite64", "pwritev", "pwritev2", "ftruncate", "truncate"),
    *("fallocate", "copy_file_range", "sendfile"),
)
_NAMES = (
    *("open", "openat", "creat", "mkdir", "mkdirat", "symlink", "symlinkat", "link", "linkat"),
    *("rename", "renameat", "renameat2", "unlink", "unlinkat", "rmdir"),
)
_SAID = ("access", "faccessat", "faccessat2")
_CALL = re.compile(r"(\d+) +(?:(<\.\.\. )?(\w+)(?(2) resumed>|\()(.*))$")
_PART = re.compile(r'(\d+|AT_FDCWD)<([^>]*)>|"([^"]*)"')


class Kind:
    """What is promised of a path."""

    SAFE = "safe"
    """What is there, with all below it, is on disk."""
    WHOLE = "whole"
    """And it never was there in part: not before, and not when it is replaced."""
    GONE = "gone"
    """Its name is not on disk."""
    FIRST = "first"
    """The first of two was on disk before the second got its name."""


@dataclass(frozen=True)
class Promise:
    """What must hold from here on."""

    kind: str
    paths: tuple[str, ...]

    @property
    def name(self) -> str:
        """How a test calls it: without the folder that all have in common."""
        return f"{self.kind} {' '.join(self.paths)}"


@dataclass(frozen=True)
class Call:
    """A call that was made without error."""

    name: str
    paths: tuple[str, ...]
    """Relative to the traced folder; outside of it: empty."""
    thread: str
    creates: bool = False
    truncates: bool = False


@dataclass(frozen=True)
class Begun:
    """A sync whose end comes after calls of other threads, which it need not cover."""

    name: str
    paths: tuple[str, ...]
    thread: str


Event = Call | Begun | Promise


def promise(kind: str, *paths: Path) -> None:
    """Say, in a traced program, what holds now."""
    os.access(":".join(("/promise", kind, *map(str, paths))), os.F_OK)


def recorded(folder: Path, command: Sequence[str], log: Path, **environment: str) -> list[Event]:
    """Run Python with such arguments; what it and its children did to the folder, in order."""
    calls = ",".join((*SYNCS, *_WRITES, *_NAMES, *_SAID))
    strace = ["strace", "-f", "--seccomp-bpf", "-y", "-s", "0", "-o", str(log), "-e", calls]
    paths = {"PYTHONPATH": os.pathsep.join(sys.path), "PYTHONDONTWRITEBYTECODE": "1"}
    subprocess.run(
        [*strace, sys.executable, *command], check=True, env={**os.environ, **paths, **environment}
    )
    return list(_events(log.read_text(errors="replace").splitlines(), folder))


def _events(lines: Sequence[str], folder: Path) -> Iterator[Event]:
    begun: dict[str, str] = {}
    for line in lines:
        if (found := _CALL.match(line)) is None:
            continue
        thread, resumed, name, rest = found.groups()
        if rest.endswith("<unfinished ...>"):
            begun[thread] = rest
            if name in SYNCS and any(paths := _changed_paths(name, rest, folder)):
                yield Begun(name, paths, thread)
            continue
        arguments, _, result = (begun.pop(thread, "") + rest if resumed else rest).rpartition(" = ")
        paths = _changed_paths(name, arguments, folder)
        if name in _SAID and "/promise:" in arguments:
            _, kind, *said = arguments[arguments.index("/promise:") :].partition('"')[0].split(":")
            yield Promise(kind, tuple(_relative(path, folder) for path in said))
        elif name not in _SAID and any(paths) and not result.startswith("-1 "):
            creates, truncates = "O_CREAT" in arguments, "O_TRUNC" in arguments
            is_creat = name == "creat"
            yield Call(name, paths, thread, creates or is_creat, truncates or is_creat)


def _changed_paths(name: str, arguments: str, folder: Path) -> tuple[str, ...]:
    """The paths that a call changes, as far as they are in the folder."""
    if name in (*SYNCS, *_WRITES) and name != "truncate":
        opened = [path for number, path, _ in _PART.findall(arguments) if number]
        return (_relative(opened[-1 if name == "copy_file_range" else 0], folder),)
    paths = tuple(_relative(path, folder) for path in _paths(arguments))
    return paths[-1:] if name.startswith("symlink") else paths


def _paths(arguments: str) -> Iterator[str]:
    """Those that a call names: `"/path"`, or `3</folder>, "name"`."""
    folder = ""
    for number, behind, text in _PART.findall(arguments):
        if number:
            folder = behind
        else:
            yield os.path.join(folder, text)  # noqa: PTH118  # text, not a path of this machine
            folder = ""


def _relative(path: str, folder: Path) -> str:
    if path == str(folder):
        return "."
    return path.removeprefix(f"{folder}/") if path.startswith(f"{folder}/") else ""


@dataclass(eq=False)
class _Node:
    """A file, or a folder with what is in it now and on disk."""

    is_folder: bool = False
    names: dict[str, _Node] = field(default_factory=dict)
    safe_names: dict[str, _Node] = field(default_factory=dict)
    written: int = 0
    """How often its bytes were changed."""
    synced: int = 0
    """After how many of these changes they were synced."""


_Synced = tuple[_Node, int, dict[str, _Node]]
"""A node, with what is on disk of it once a sync has ended."""


class Disk:
    """Replays calls; tells which promises are broken."""

    def __init__(self, promises: Sequence[Promise]) -> None:
        self._root = _Node(is_folder=True)
        self._whole = {p.paths[0]: p for p in promises if p.kind == Kind.WHOLE}
        self._first = {p: False for p in promises if p.kind == Kind.FIRST}
        self._begun: dict[str, list[_Synced]] = {}
        self.broken: set[Promise] = set()

    def hold(self, promise: Promise) -> None:
        """See whether a promise holds as it is made."""
        match promise.kind:
            case Kind.SAFE | Kind.WHOLE:
                holds = self._is_safe(promise.paths[0])
            case Kind.GONE:
                folder, name = self._place(promise.paths[0])
                holds = name not in folder.safe_names
            case Kind.FIRST:
                holds = self._first[promise]
            case _:
                raise ValueError(promise.kind)
        if not holds:
            self.broken.add(promise)

    def begin(self, begun: Begun) -> None:
        """Replay the first half of a sync."""
        self._begun[begun.thread] = self._covered(begun)

    def sync(self, call: Call) -> None:
        """Replay one, or the second half of it."""
        for node, written, names in self._begun.pop(call.thread, None) or self._covered(call):
            node.synced, node.safe_names = written, names

    def make(self, call: Call) -> None:
        """Replay another call."""
        match call.name, call.paths:
            case ("open" | "openat" | "creat", (path, *_)):
                self._open(path, call)
            case ("mkdir" | "mkdirat", (path,)):
                self._name(path, _Node(is_folder=True))
            case ("symlink" | "symlinkat", (path,)):
                self._name(path, _Node())
            case ("link" | "linkat", (old, new)):
                self._name(new, self._find(old))
            case ("rename" | "renameat" | "renameat2", (old, new)):
                node = self._find(old)
                self._unname(old)
                self._name(new, node)
            case ("unlink" | "unlinkat" | "rmdir", (path,)):
                self._unname(path)
            case (name, (path,)) if name in _WRITES:
                self._write(path)
            case _:
                raise ValueError(f"what {call} does is not known here")

    def _open(self, path: str, call: Call) -> None:
        if not path:
            return
        folder, name = self._place(path)
        if call.creates and name not in folder.names:
            self._name(path, _Node(), is_new=True)
        elif call.truncates:
            self._write(path)

    def _write(self, path: str) -> None:
        if path.endswith(" (deleted)"):
            return
        self._find(path).written += 1
        if path in self._whole:
            self.broken.add(self._whole[path])  # in its place, where a part of it can be read

    def _name(self, path: str, node: _Node | None, *, is_new: bool = False) -> None:
        if node is None or not path:
            return
        folder, name = self._place(path)
        folder.names[name] = node
        for at, whole in self._whole.items():
            if at == path or at.startswith(f"{path}/"):
                inner = _walk(node, at[len(path) + 1 :])
                if is_new or (inner is not None and not _is_whole(inner)):
                    self.broken.add(whole)
        for each in self._first:
            if each.paths[1] == path:
                self._first[each] = self._is_safe(each.paths[0])

    def _unname(self, path: str) -> None:
        if path:
            folder, name = self._place(path)
            folder.names.pop(name, None)

    def _covered(self, sync: Call | Begun) -> list[_Synced]:
        node = self._root if sync.name == "syncfs" else self._find(sync.paths[0])
        nodes = _below(node) if sync.name == "syncfs" else (node,)
        return [(each, each.written, dict(each.names)) for each in nodes]

    def _is_safe(self, path: str) -> bool:
        node = self._root
        for name in path.split("/"):
            here, there = node.names.get(name), node.safe_names.get(name)
            if here is None or here is not there:
                return False
            node = here
        return _is_whole(node)

    def _find(self, path: str) -> _Node:
        node = self._root if path == "." else _walk(self._root, path)
        if node is None:
            raise ValueError(f"{path} was not made while it was traced")
        return node

    def _place(self, path: str) -> tuple[_Node, str]:
        above, _, name = path.rpartition("/")
        return self._find(above or "."), name


def _walk(node: _Node | None, path: str) -> _Node | None:
    for name in path.split("/") if path else ():
        node = node.names.get(name) if node is not None else None
    return node


def _is_whole(node: _Node) -> bool:
    """Whether all that is there, and all below it, was synced."""
    return node.written == node.synced and all(
        node.safe_names.get(name) is each and _is_whole(each) for name, each in node.names.items()
    )


def _below(node: _Node) -> Iterator[_Node]:
    yield node
    for each in node.names.values():
        yield from _below(each)


def broken(events: Sequence[Event], without: int | None = None) -> list[str]:
    """The promises that a power failure at some moment could break; `without`: when the sync of
    that place in the list had not been made."""
    disk = Disk([event for event in events if isinstance(event, Promise)])
    for number, event in enumerate(events):
        if isinstance(event, Promise):
            disk.hold(event)
        elif isinstance(event, Begun):
            disk.begin(event)
        elif event.name not in SYNCS:
            disk.make(event)
        elif number != without:
            disk.sync(event)
    return sorted(promise.name for promise in disk.broken)
