"""A component's venv: made in-process, filled with hard links to the store, run by its worker only.

In purelib and platlib the result is what `pip install --no-index --no-deps --require-hashes` gives,
installer metadata and compiled files apart. `make_with_pip` runs pip itself instead.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from nondum.sdk.errors import InstallFailed, Problem
from nondum.wheelhouse.format.lock import LockedWheel
from nondum.wheelhouse.store import pip_target
from nondum.wheelhouse.store.stored import StoredWheel

PIP_TIMEOUT_S = 600
PIP_ALIVE_S = 5


def site_packages(venv: Path) -> Path:
    """Where a venv's distributions lie."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    return venv / "lib" / version / "site-packages"


def make(venv: Path, python: Path, wheels: Sequence[StoredWheel]) -> None:
    """Make a venv of stored wheels, replacing any that is there; whole, or not at all.

    Raises `InstallFailed` (FILES_COLLIDE, DISK_FULL, IO_ERROR).
    """
    unfinished = _fresh(venv)
    try:
        _skeleton(unfinished, python)
        tree = _Tree(site_packages(unfinished))
        for stored in wheels:
            tree.add(stored)
        _link_compiled(unfinished, wheels)
        unfinished.rename(venv)
    except OSError as error:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise _failed(error, venv) from error
    except InstallFailed:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise


def add_compiled(venv: Path, wheels: Sequence[StoredWheel]) -> None:
    """Link what was compiled since a venv was made; processes that run in it see whole files only.

    Raises `InstallFailed` (DISK_FULL, IO_ERROR).
    """
    try:
        _link_compiled(venv, wheels)
    except OSError as error:
        raise _failed(error, venv) from error


def make_with_pip(
    venv: Path,
    python: Path,
    folder: Path,
    wheels: Sequence[LockedWheel],
    alive: Callable[[], None] = lambda: None,
) -> None:
    """Make a venv by pip, from the wheels of a staged payload folder, by hash and offline.

    pip runs from this interpreter, never from the venv; `alive` is called every few seconds while
    it does. Raises `InstallFailed` (PIP_FAILED).
    """
    unfinished = _fresh(venv)
    _skeleton(unfinished, python)
    requirements = unfinished / "requirements.txt"
    requirements.write_text(
        "".join(f"{(folder / w.path).resolve()} --hash=sha256:{w.sha256}\n" for w in wheels),
        encoding="utf-8",
    )
    command = [
        *(sys.executable, "-I", "-c", _PIP, str(os.getpid())),
        *("--isolated", "install", "--no-index", "--no-deps"),
        *("--only-binary", ":all:", "--require-hashes", "--no-cache-dir", "--no-compile"),
        *("--no-input", "--disable-pip-version-check", "--quiet", "--no-warn-script-location"),
        *("--target", str(site_packages(unfinished).absolute())),
        *("--requirement", str(requirements.absolute())),
    ]
    failure = _run_pip(command, alive)
    if failure is not None:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise InstallFailed(Problem("PIP_FAILED", failure, where=str(folder)))
    requirements.unlink()
    pip_target.trim(site_packages(unfinished))
    unfinished.rename(venv)


_PIP = """
import ctypes, os, runpy, signal, sys
ctypes.CDLL(None).prctl(1, signal.SIGKILL)
if os.getppid() == int(sys.argv.pop(1)):
    runpy.run_module("pip", run_name="__main__", alter_sys=True)
"""
"""pip, killed with the thread that waits for it (PR_SET_PDEATHSIG): it would write on where
the next one does."""


def _run_pip(command: Sequence[str], alive: Callable[[], None]) -> str | None:
    """Why pip failed, or None when it did not."""
    with subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={"PATH": os.defpath, "LC_ALL": "C.UTF-8"},
        cwd="/",
    ) as pip:
        for _ in range(0, PIP_TIMEOUT_S, PIP_ALIVE_S):
            try:
                _, errors = pip.communicate(timeout=PIP_ALIVE_S)
            except subprocess.TimeoutExpired:
                alive()
                continue
            last = (errors.strip().splitlines() or ["pip said nothing"])[-1]
            return last if pip.returncode else None
        pip.kill()
    return f"pip was not done after {PIP_TIMEOUT_S} s"


def remove(venv: Path) -> None:
    """Delete a venv, if it is there."""
    for path in (venv, _unfinished(venv)):
        shutil.rmtree(path, ignore_errors=True)


def _unfinished(venv: Path) -> Path:
    return venv.with_name(f".{venv.name}.part")


def _fresh(venv: Path) -> Path:
    remove(venv)
    unfinished = _unfinished(venv)
    unfinished.mkdir(parents=True)
    return unfinished


def _skeleton(venv: Path, python: Path) -> None:
    """What makes a folder a venv to interpreters and tools (PEP 405)."""
    version = f"{sys.version_info.major}.{sys.version_info.minor}.{sys.version_info.micro}"
    (venv / "pyvenv.cfg").write_text(
        f"home = {python.parent}\ninclude-system-site-packages = false\nversion = {version}\n",
        encoding="utf-8",
    )
    (venv / "bin").mkdir()
    (venv / "bin/python").symlink_to(python)
    site_packages(venv).mkdir(parents=True)


class _Tree:
    """A site-packages folder as it fills. Paths are strings: there are thousands of them."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._files: dict[str, tuple[str, str]] = {}
        self._folders: dict[str, str] = {"": ""}
        """Path → the wheel that was first to have it."""

    def add(self, stored: StoredWheel) -> None:
        """Link a wheel's files. Raises `InstallFailed` (FILES_COLLIDE)."""
        for file in stored.files:
            owner, sha256 = self._files.setdefault(file.path, (stored.filename, file.sha256))
            if owner != stored.filename:
                if sha256 == file.sha256:
                    continue  # old-style namespace packages all carry the same __init__.py
                raise _collide(file.path, owner, stored.filename)
            if file.path in self._folders:
                raise _collide(file.path, self._folders[file.path], stored.filename)
            self._make_folder(file.path.rpartition("/")[0], stored.filename)
            _link(f"{stored.root}/{file.path}", f"{self._root}/{file.path}")

    def _make_folder(self, path: str, wheel: str) -> None:
        if path in self._folders:
            return
        if path in self._files:
            raise _collide(path, self._files[path][0], wheel)
        self._make_folder(path.rpartition("/")[0], wheel)
        (self._root / path).mkdir()
        self._folders[path] = wheel


def _collide(path: str, one: str, other: str) -> InstallFailed:
    return InstallFailed(
        Problem(
            "FILES_COLLIDE",
            f"{path} is in {one} and, as something else, in {other}",
            where=path,
            fix="ask their authors: two distributions may not share a file",
        )
    )


def _link_compiled(venv: Path, wheels: Sequence[StoredWheel]) -> None:
    """Link compiled files where their place is free: wheels may bring the same, or their own."""
    root = site_packages(venv)
    for stored in wheels:
        for file in stored.compiled_here or ():
            source, target = f"{stored.root}/{file.path}", f"{root}/{file.path}"
            with contextlib.suppress(FileExistsError, NotADirectoryError):
                try:
                    _link(source, target)
                except FileNotFoundError:  # the first one in its folder
                    Path(target).parent.mkdir()
                    _link(source, target)


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)  # strings, not paths: thousands of files
    except OSError as error:
        if error.errno != errno.EXDEV:  # the store may lie on another file system
            raise
        _copy(source, target)


def _copy(source: str, target: str) -> None:
    """Copy a file; it is there whole or not at all, and nothing is replaced."""
    copy = f"{target}.part"
    shutil.copy2(source, copy)
    try:
        os.link(copy, target)
    finally:
        Path(copy).unlink()


def _failed(error: OSError, venv: Path) -> InstallFailed:
    code = "DISK_FULL" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "IO_ERROR"
    text = f"the venv cannot be filled: {error.strerror}"
    return InstallFailed(Problem(code, text, where=str(venv)))
