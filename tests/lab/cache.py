"""Where the laboratory keeps what takes long to make; a thing is there whole, or not at all."""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

DONE = ".done"
IN_USE_S = 3 * 3600.0
"""A run that began longer ago than this is over."""
MODEST = ("nice", "-n", os.environ.get("NONDUM_LAB_NICE", "15"))
"""Begins the command of what takes much of a processor: others may need it, too."""


def cache_folder() -> Path:
    """`$NONDUM_LAB_CACHE`, else a folder in the user's cache."""
    default = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nondum-lab"
    return Path(os.environ.get("NONDUM_LAB_CACHE") or default)


def kept(name: str, make: Callable[[Path], None]) -> Path:
    """The folder of this name in the cache; `make` fills it when it is not there.

    Names that begin alike up to their last hyphen are versions of one thing: the two used last
    stay, and what another laboratory may be using. Two that want the same wait for each other.
    """
    cache = cache_folder()
    cache.mkdir(parents=True, exist_ok=True)
    folder = cache / name
    kind = name.rpartition("-")[0]
    with (cache / f".{kind}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / DONE).exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            make(folder)
            (folder / DONE).touch()
        os.utime(folder)
        _forget(cache, kind)
    return folder


def call(*command: str | Path, env: dict[str, str] | None = None) -> str:
    """Run a program of the machine that the laboratory stands on, with few claims on its processor.

    Returns what it wrote. Raises `RuntimeError` with its last words.
    """
    words: Sequence[str | Path] = (*MODEST, *command)
    surroundings = {**os.environ, **(env or {})}
    done = subprocess.run(
        words, capture_output=True, text=True, stdin=subprocess.DEVNULL, env=surroundings
    )
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip()[-4000:]
        raise RuntimeError(f"{' '.join(map(str, command))}\nexited with {done.returncode}:\n{said}")
    return done.stdout


def _forget(cache: Path, kind: str) -> None:
    versions = [f for f in cache.iterdir() if f.name.rpartition("-")[0] == kind]
    for folder in sorted(versions, key=_used)[:-2]:
        if _used(folder) < time.time() - IN_USE_S:
            shutil.rmtree(folder, ignore_errors=True)


def _used(folder: Path) -> float:
    return folder.stat().st_mtime
