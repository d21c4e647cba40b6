"""An entry of the store, and the manifest that tells of it."""

from __future__ import annotations

import json
from pathlib import Path

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.store import bytecode
from nondum.wheelhouse.store.unpacking import StoredFile

MANIFEST = "manifest.json"
FILES = "files"


@frozen
class CompiledFiles:
    """What was compiled of a wheel for one kind of interpreter."""

    tag: str
    """As the names of compiled files have it: `cpython-311`."""
    files: tuple[StoredFile, ...]


@frozen
class StoredWheel:
    """A wheel in the store."""

    sha256: str
    """Of the wheel file that it was unpacked from."""
    filename: str
    folder: Path
    files: tuple[StoredFile, ...]
    left_out: tuple[str, ...] = ()
    """Members that were not unpacked."""
    compiled: tuple[CompiledFiles, ...] = ()
    """For each kind of interpreter that it was compiled for."""

    @property
    def size(self) -> int:
        """Bytes of its files, compiled ones among them."""
        return sum(file.size for file in self.all_files)

    @property
    def root(self) -> Path:
        """Folder that its files are under."""
        return self.folder / FILES

    @property
    def all_files(self) -> tuple[StoredFile, ...]:
        """Its own files, then those that were compiled."""
        return sum((compiled.files for compiled in self.compiled), self.files)

    @property
    def compiled_here(self) -> tuple[StoredFile, ...] | None:
        """What was compiled for interpreters like this one; None: it has not been tried."""
        found = (compiled.files for compiled in self.compiled if compiled.tag == bytecode.TAG)
        return next(found, None)

    def manifest(self) -> str:
        """What `read_entry` reads."""
        said = {
            "wheel": self.filename,
            "files": _rows(self.files),
            "left_out": self.left_out,
            "compiled": {compiled.tag: _rows(compiled.files) for compiled in self.compiled},
        }
        return json.dumps(said)


def read_entry(folder: Path) -> StoredWheel | None:
    """The entry in a folder, or None if there is none or its manifest is damaged."""
    try:
        said = json.loads((folder / MANIFEST).read_bytes())
        return StoredWheel(
            sha256=folder.name,
            filename=said["wheel"],
            folder=folder,
            files=_files(said["files"]),
            left_out=tuple(said["left_out"]),
            compiled=tuple(
                CompiledFiles(tag, _files(rows)) for tag, rows in said.get("compiled", {}).items()
            ),
        )
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return None


def _rows(files: tuple[StoredFile, ...]) -> list[list[str | int]]:
    return [[file.path, file.size, file.sha256] for file in files]


def _files(rows: list[tuple[str, int, str]]) -> tuple[StoredFile, ...]:
    return tuple(StoredFile(*row) for row in rows)
