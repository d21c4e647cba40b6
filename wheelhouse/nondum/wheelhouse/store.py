"""The store: verified wheels, unpacked once, each under the hash of the wheel that it came from.

    store/<sha256>/
        manifest.json      what the wheel was, and path, size and SHA-256 of every file
        files/…            site-packages as this wheel fills it

A wheel is hashed and unpacked from the same bytes, synced to disk, and renamed in: what is there
is whole. Before files are used again they are hashed again. Venvs are hard links to them.
"""

from __future__ import annotations

import ctypes
import errno
import hashlib
import json
import os
import shutil
import zlib
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem
from nondum.wheelhouse import archive, wheel
from nondum.wheelhouse.archive import Bytes
from nondum.wheelhouse.wheel import Layout, PlannedFile

MANIFEST = "manifest.json"
FILES = "files"
THREADS = 2
"""Inflating lets other threads run; more than two gained nothing where it was measured."""

_CHUNK = 1024 * 1024
_libc = ctypes.CDLL(None, use_errno=True)


@dataclass(frozen=True, slots=True)
class StoredFile:
    """One file of a stored wheel."""

    path: str
    size: int
    sha256: str


@dataclass(frozen=True, slots=True)
class StoredWheel:
    """A wheel in the store."""

    sha256: str
    """Of the wheel file that it was unpacked from."""
    filename: str
    folder: Path
    files: tuple[StoredFile, ...]
    left_out: tuple[str, ...] = ()
    """Members that were not unpacked."""

    @property
    def size(self) -> int:
        """Bytes of its files."""
        return sum(file.size for file in self.files)

    @property
    def root(self) -> Path:
        """Folder that its files are under."""
        return self.folder / FILES


class Store:
    """A folder of stored wheels. One process writes to it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        root.mkdir(parents=True, exist_ok=True)

    def add(
        self,
        wheel_path: Path,
        sha256: str,
        progress: Callable[[int], None] | None = None,
    ) -> StoredWheel:
        """Unpack a wheel whose hash is given, unless it is here and whole.

        The file must not change meanwhile: give a staged copy. `progress` gets bytes as they are
        written. Raises `PayloadRefused` (HASH_MISMATCH, WHEEL_…), `InstallFailed` (DISK_FULL, …).
        """
        if (known := self.get(sha256)) is not None and not self.verify(sha256):
            os.utime(known.folder)
            return known
        self.remove(sha256)
        unfinished = self.root / f".{sha256}.part"
        shutil.rmtree(unfinished, ignore_errors=True)
        try:
            with wheel.opened(wheel_path) as data:
                stored = self._unpack(data, wheel_path.name, sha256, unfinished, progress)
            _sync_file_system(unfinished)
            unfinished.rename(stored.folder)
            _sync_folder(self.root)
        except OSError as error:
            shutil.rmtree(unfinished, ignore_errors=True)
            raise _failed(error, wheel_path.name) from error
        except PayloadRefused:
            shutil.rmtree(unfinished, ignore_errors=True)
            raise
        return stored

    def get(self, sha256: str) -> StoredWheel | None:
        """A stored wheel by hash, without looking at its files."""
        folder = self.root / sha256
        try:
            said = json.loads((folder / MANIFEST).read_bytes())
            files = tuple(StoredFile(*row) for row in said["files"])
            return StoredWheel(sha256, said["wheel"], folder, files, tuple(said["left_out"]))
        except (OSError, ValueError, LookupError, TypeError):
            return None

    def verify(self, sha256: str) -> tuple[Problem, ...]:
        """Hash a stored wheel's files again; what is not as it was."""
        stored = self.get(sha256)
        if stored is None:
            return (Problem("STORE_MISSING", "the wheel is not in the store", where=sha256),)
        with ThreadPoolExecutor(THREADS) as pool:
            whole = pool.map(lambda file: _is_whole(stored.root / file.path, file), stored.files)
            return tuple(
                Problem(
                    "STORE_DAMAGED",
                    f"{file.path} of {stored.filename} is not what was stored",
                    where=str(stored.folder),
                    fix="it is unpacked again from the payload",
                )
                for file, is_whole in zip(stored.files, whole, strict=True)
                if not is_whole
            )

    def listing(self) -> tuple[StoredWheel, ...]:
        """All stored wheels, by file name."""
        found = (self.get(folder.name) for folder in self.root.iterdir())
        return tuple(sorted((w for w in found if w), key=lambda w: (w.filename, w.sha256)))

    def remove(self, sha256: str) -> None:
        """Delete a stored wheel; venvs that link to its files keep them."""
        folder = self.root / sha256
        if folder.exists():
            doomed = self.root / f".{sha256}.gone"
            shutil.rmtree(doomed, ignore_errors=True)
            folder.rename(doomed)
            shutil.rmtree(doomed)

    def prune(self, keep: Collection[str], quota_bytes: int) -> tuple[StoredWheel, ...]:
        """Delete wheels outside `keep`, least recently used first, until the rest fits the quota.

        Returns what was deleted.
        """
        by_use = sorted(self.listing(), key=lambda w: w.folder.stat().st_mtime)
        total = sum(stored.size for stored in by_use)
        deleted = []
        for stored in by_use:
            if total <= quota_bytes:
                break
            if stored.sha256 not in keep:
                self.remove(stored.sha256)
                total -= stored.size
                deleted.append(stored)
        return tuple(deleted)

    def sweep(self) -> tuple[Path, ...]:
        """Delete what an interrupted run left half done; returns what it was."""
        left = tuple(path for path in self.root.iterdir() if path.name.startswith("."))
        for path in left:
            shutil.rmtree(path)
        return left

    def _unpack(
        self,
        data: Bytes,
        filename: str,
        sha256: str,
        folder: Path,
        progress: Callable[[int], None] | None,
    ) -> StoredWheel:
        if hashlib.sha256(data).hexdigest() != sha256:
            raise PayloadRefused(
                Problem("HASH_MISMATCH", "is not the wheel that was locked", where=filename)
            )
        layout = wheel.lay_out(data, filename)
        wheel.refuse_if_any(layout.problems)
        root = folder / FILES
        for parent in sorted({Path(file.target).parent for file in layout.files}):
            (root / parent).mkdir(parents=True, exist_ok=True)
        files = _written(data, filename, layout, root, progress)
        said = {
            "wheel": filename,
            "files": [[file.path, file.size, file.sha256] for file in files],
            "left_out": layout.left_out,
        }
        (folder / MANIFEST).write_text(json.dumps(said), encoding="utf-8")
        return StoredWheel(sha256, filename, self.root / sha256, files, layout.left_out)


def _written(
    data: Bytes,
    filename: str,
    layout: Layout,
    root: Path,
    progress: Callable[[int], None] | None,
) -> tuple[StoredFile, ...]:
    """Write all files, largest first, in parallel."""

    def write(file: PlannedFile) -> StoredFile | Problem:
        try:
            stored = _write(data, file, root / file.target)
        except (ValueError, zlib.error) as error:
            return wheel.damaged(file, filename, str(error))
        if file.sha256 and stored.sha256 != file.sha256:
            return wheel.damaged(file, filename, "it is not what RECORD says")
        if progress is not None:
            progress(stored.size)
        return stored

    largest_first = sorted(layout.files, key=lambda file: -file.member.size)
    with ThreadPoolExecutor(THREADS) as pool:
        results = list(pool.map(write, largest_first))
    wheel.refuse_if_any(tuple(r for r in results if isinstance(r, Problem)))
    stored = (result for result in results if isinstance(result, StoredFile))
    return tuple(sorted(stored, key=lambda file: file.path))


def _write(data: Bytes, file: PlannedFile, target: Path) -> StoredFile:
    digest = hashlib.sha256()
    # Buffered: a raw file on a full disk writes less than it was given, and does not raise.
    with target.open("xb") as out:
        for piece in archive.unpack(data, file.member):
            digest.update(piece)
            out.write(piece)
    target.chmod(0o555 if file.member.is_executable else 0o444)
    return StoredFile(file.target, file.member.size, digest.hexdigest())


def _is_whole(path: Path, file: StoredFile) -> bool:
    try:
        with path.open("rb", buffering=0) as content:
            is_same_size = os.fstat(content.fileno()).st_size == file.size
            return is_same_size and _digest(content.fileno()) == file.sha256
    except OSError:
        return False


def _digest(descriptor: int) -> str:
    digest = hashlib.sha256()
    for piece in _pieces(descriptor):
        digest.update(piece)
    return digest.hexdigest()


def _pieces(descriptor: int) -> Iterator[bytes]:
    while piece := os.read(descriptor, _CHUNK):
        yield piece


def _sync_file_system(folder: Path) -> None:
    """syncfs(2): one call for all files just written, cheaper than an fsync for each."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        if _libc.syncfs(descriptor) != 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code))
    finally:
        os.close(descriptor)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _failed(error: OSError, what: str) -> InstallFailed:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        fix = "free some disk, or lower the store's quota"
        return InstallFailed(Problem("DISK_FULL", "there is no room to store it", what, fix=fix))
    return InstallFailed(Problem("IO_ERROR", f"cannot be stored: {error.strerror}", where=what))
