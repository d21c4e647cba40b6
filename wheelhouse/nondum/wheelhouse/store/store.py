"""The store: verified wheels, unpacked once, each under the hash of the wheel that it came from.

    store/<sha256>/
        manifest.json      what the wheel was, and path, size and SHA-256 of every file
        files/…            site-packages as this wheel fills it, compiled files beside the modules

A wheel is hashed and unpacked from the same bytes, synced to disk, and renamed in: what is there
is whole. Compiled files come later; those that the manifest tells of are there and whole. Before
files are used again they are hashed again. Venvs are hard links to them.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem
from nondum.wheelhouse.store import bytecode, checking, disk, unpacking
from nondum.wheelhouse.store.quota import Kept
from nondum.wheelhouse.store.stored import FILES, MANIFEST, CompiledFiles, StoredWheel, read_entry
from nondum.wheelhouse.store.unpacking import Progress, Source, Unpacked

UNFINISHED = ".part"
"""Folder of an entry for what is not in its place yet."""


class Store:
    """A folder of stored wheels. One process writes to it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        disk.make_folder(root)

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
        alive: Callable[[], None] = lambda: None,
    ) -> tuple[StoredWheel, ...]:
        """Unpack wheels whose hashes are given, but those that are here and whole: while these are
        read, `alive` is called from any thread.

        The files must not change meanwhile: give staged copies. Either all of them are stored or
        none of those that were not. Raises `PayloadRefused` (HASH_MISMATCH, WHEEL_…),
        `InstallFailed` (DISK_FULL, …).
        """
        stored: dict[str, StoredWheel] = {}
        sources = []
        for path, sha256 in wheels:
            if (known := self.whole(sha256, alive)) is not None:
                os.utime(known.folder)
                stored[sha256] = known
            else:
                self.remove(sha256)
                sources.append(Source(path, sha256, self._unfinished(sha256) / FILES))
        try:
            stored.update((wheel.sha256, wheel) for wheel in self._unpack(sources, progress))
        except OSError as error:
            names = ", ".join(source.path.name for source in sources)
            failed = _failed(error, names, self.root)  # says how full the disk is now
            self._clear_away(sources)
            raise failed from error
        except PayloadRefused:
            self._clear_away(sources)
            raise
        return tuple(stored[sha256] for _, sha256 in wheels)

    def has(self, sha256: str) -> bool:
        """Whether a wheel of this hash is stored, without reading anything of it."""
        return (self.root / sha256).is_dir()

    def get(self, sha256: str) -> StoredWheel | None:
        """A stored wheel by hash, without looking at its files."""
        return read_entry(self.root / sha256)

    def verify(self, sha256: str) -> tuple[Problem, ...]:
        """Hash a stored wheel's files again; what is not as it was."""
        stored = self.get(sha256)
        if stored is None:
            return (_missing(sha256),)
        return tuple(
            Problem(
                "STORE_DAMAGED",
                f"{file.path} of {stored.filename} is not what was stored",
                where=str(stored.folder),
                fix="it is unpacked again from the payload",
            )
            for file in checking.damaged(stored.root, stored.all_files)
        )

    def whole(self, sha256: str, alive: Callable[[], None] = lambda: None) -> StoredWheel | None:
        """A stored wheel whose files have been hashed again, if they are as they were.

        Compiled files are dropped if any of them is not. `alive` is called, from any thread, while
        large ones are read. Raises `InstallFailed`, and what `checking.damaged` raises.
        """
        stored = self.get(sha256)
        if stored is None:
            return None
        if not (damaged := checking.damaged(stored.root, stored.all_files, alive)):
            return stored
        if not set(damaged).isdisjoint(stored.files):
            return None
        kept = replace(stored, compiled=())
        try:
            _replace_manifest(kept)
            for file in stored.all_files[len(stored.files) :]:
                (stored.root / file.path).unlink(missing_ok=True)
        except OSError as error:
            raise _failed(error, stored.filename, self.root) from error
        return kept

    def compile(self, sha256: str, progress: Callable[[int], None] | None = None) -> StoredWheel:
        """Compile a stored wheel's modules for interpreters like this one, unless they are.

        `progress` gets bytes of source. It may be killed at any moment. Raises `InstallFailed`
        (STORE_MISSING, DISK_FULL, …).
        """
        stored = self.get(sha256)
        if stored is None:
            raise InstallFailed(_missing(sha256))
        if stored.compiled_here is not None:
            return stored
        unfinished = stored.folder / UNFINISHED
        try:
            shutil.rmtree(unfinished, ignore_errors=True)
            files = bytecode.write(stored.root, stored.files, unfinished, progress)
            for file in files:
                target = stored.root / file.path
                target.parent.mkdir(exist_ok=True)
                (unfinished / file.path).rename(target)
            compiled = (*stored.compiled, CompiledFiles(bytecode.TAG, files))
            stored = replace(stored, compiled=compiled)
            disk.sync_file_system(stored.folder)
            _replace_manifest(stored)
        except OSError as error:
            raise _failed(error, stored.filename, self.root) from error
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
        return stored

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

    def kept(self) -> Iterator[Kept]:
        """All stored wheels, for what prunes them."""
        for stored in self.listing():
            yield Kept(stored.sha256, stored.size, stored.folder.stat().st_mtime)

    def sweep(self) -> tuple[Path, ...]:
        """Delete what an interrupted run left half done; returns what it was."""
        left = (*self.root.glob(".*"), *self.root.glob(f"[!.]*/{UNFINISHED}"))
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
        disk.sync_file_system(self.root)
        for wheel in stored:
            self._unfinished(wheel.sha256).rename(wheel.folder)
        disk.sync(self.root)
        return stored

    def _told(self, source: Source, unpacked: Unpacked) -> StoredWheel:
        """Write the manifest of an unpacked wheel."""
        folder = self.root / source.sha256
        wheel = StoredWheel(
            source.sha256, source.path.name, folder, unpacked.files, unpacked.left_out
        )
        manifest = self._unfinished(source.sha256) / MANIFEST
        manifest.write_text(wheel.manifest(), encoding="utf-8")
        return wheel

    def _unfinished(self, sha256: str) -> Path:
        return self.root / f".{sha256}.part"

    def _clear_away(self, sources: Sequence[Source]) -> None:
        for source in sources:
            shutil.rmtree(self._unfinished(source.sha256), ignore_errors=True)


def _missing(sha256: str) -> Problem:
    return Problem("STORE_MISSING", "the wheel is not in the store", where=sha256)


def _replace_manifest(wheel: StoredWheel) -> None:
    """Have an entry's manifest tell of what is there now; it is the old one or the new one."""
    unfinished = wheel.folder / UNFINISHED
    unfinished.mkdir(exist_ok=True)
    with (unfinished / MANIFEST).open("w", encoding="utf-8") as manifest:
        manifest.write(wheel.manifest())
        manifest.flush()
        os.fsync(manifest.fileno())
    (unfinished / MANIFEST).rename(wheel.folder / MANIFEST)
    disk.sync(wheel.folder)
    shutil.rmtree(unfinished)


def _failed(error: OSError, wheels: str, where: Path) -> InstallFailed:
    return disk.failed(error, f"{wheels} cannot be stored", where)
