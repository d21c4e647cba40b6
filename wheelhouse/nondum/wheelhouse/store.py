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
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem
from nondum.wheelhouse import unpacking
from nondum.wheelhouse.unpacking import THREADS, Progress, Source, StoredFile, Unpacked

MANIFEST = "manifest.json"
FILES = "files"
_CHUNK = 1024 * 1024
_libc = ctypes.CDLL(None, use_errno=True)


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
        progress: Progress | None = None,
    ) -> StoredWheel:
        """Unpack one wheel (see `add_all`)."""
        (stored,) = self.add_all([(wheel_path, sha256)], progress)
        return stored

    def add_all(
        self,
        wheels: Sequence[tuple[Path, str]],
        progress: Progress | None = None,
    ) -> tuple[StoredWheel, ...]:
        """Unpack wheels whose hashes are given, but those that are here and whole.

        The files must not change meanwhile: give staged copies. Either all of them are stored or
        none of those that were not. Raises `PayloadRefused` (HASH_MISMATCH, WHEEL_…),
        `InstallFailed` (DISK_FULL, …).
        """
        stored: dict[str, StoredWheel] = {}
        sources = []
        for path, sha256 in wheels:
            if (known := self.get(sha256)) is not None and not self.verify(sha256):
                os.utime(known.folder)
                stored[sha256] = known
            else:
                self.remove(sha256)
                sources.append(Source(path, sha256, self._unfinished(sha256) / FILES))
        try:
            stored.update((wheel.sha256, wheel) for wheel in self._unpack(sources, progress))
        except OSError as error:
            self._clear_away(sources)
            raise _failed(error, ", ".join(source.path.name for source in sources)) from error
        except PayloadRefused:
            self._clear_away(sources)
            raise
        return tuple(stored[sha256] for _, sha256 in wheels)

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
        self, sources: Sequence[Source], progress: Progress | None
    ) -> tuple[StoredWheel, ...]:
        """Unpack, sync once, rename in."""
        if not sources:
            return ()
        self._clear_away(sources)
        unpacked = unpacking.unpack(sources, progress)
        stored = tuple(self._told(s, found) for s, found in zip(sources, unpacked, strict=True))
        _sync_file_system(self.root)
        for wheel in stored:
            self._unfinished(wheel.sha256).rename(wheel.folder)
        _sync_folder(self.root)
        return stored

    def _told(self, source: Source, unpacked: Unpacked) -> StoredWheel:
        """Write the manifest of an unpacked wheel."""
        said = {
            "wheel": source.path.name,
            "files": [[file.path, file.size, file.sha256] for file in unpacked.files],
            "left_out": unpacked.left_out,
        }
        manifest = self._unfinished(source.sha256) / MANIFEST
        manifest.write_text(json.dumps(said), encoding="utf-8")
        folder = self.root / source.sha256
        return StoredWheel(
            source.sha256, source.path.name, folder, unpacked.files, unpacked.left_out
        )

    def _unfinished(self, sha256: str) -> Path:
        return self.root / f".{sha256}.part"

    def _clear_away(self, sources: Sequence[Source]) -> None:
        for source in sources:
            shutil.rmtree(self._unfinished(source.sha256), ignore_errors=True)


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
