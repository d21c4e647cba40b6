"""Wheels of source folders that payloads depend on, kept while their sources stay the same.

They lie in the user's cache folder, one per source folder: making one takes longer than all else
in the build of a small payload.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from nondum.wheelhouse.build import resolve
from nondum.wheelhouse.build.resolve import Sources

_WITHOUT_EFFECT = {"__pycache__", "build", "dist"}


def library_wheel(package: Path, folder: Path, sources: Sources) -> Path:
    """The wheel of a source folder, in `folder`, which is made. Raises as `resolve.make_wheel`."""
    place = _cache() / hashlib.sha256(os.fsencode(package.resolve())).hexdigest()[:16]
    digest = _digest(package)
    for kept in place.glob(f"{digest}/*.whl"):
        folder.mkdir(parents=True)
        return Path(shutil.copy(kept, folder))
    made = resolve.make_wheel(package, folder, sources)
    _keep(made, place, digest)
    return made


def _keep(wheel: Path, place: Path, digest: str) -> None:
    """Put a wheel in the cache instead of those of older sources; several may do so at once."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(dir=place, prefix="."))
        shutil.copy(wheel, unfinished)
        for older in place.glob("[!.]*"):
            shutil.rmtree(older, ignore_errors=True)
        unfinished.rename(place / digest)
    except OSError:
        return  # a cache that cannot be written to, or that another build has just filled


def _cache() -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(root) / "nondum/wheels"


def _digest(package: Path) -> str:
    total = hashlib.sha256(sys.version.encode())
    for path in _sources(package):
        data = path.read_bytes()
        total.update(f"{path.relative_to(package)}\0{len(data)}\0".encode())
        total.update(data)
    return total.hexdigest()


def _sources(package: Path) -> Iterator[Path]:
    for path in sorted(package.rglob("*")):
        parts = path.relative_to(package).parts
        if path.is_file() and not any(p.startswith(".") or p in _WITHOUT_EFFECT for p in parts):
            yield path
