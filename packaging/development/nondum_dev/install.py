"""Installs into the environment of the Python that runs this.

What others wrote is taken in the locked version, if it has a locked hash, and without pip looking
for what it depends on: that is in the lock. What is of the checkout is built here, from no index.
An environment in which anybody has not what they ask for is an error.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from nondum_dev import asked, lockfile
from nondum_dev.consistency import Checked
from nondum_dev.overruled import OVERRULED
from nondum_dev.places import BESIDE, CHECKOUT, LOCK, LOCK_NAME
from nondum_dev.problem import DoesNotFit, SetUpFailed

PIP = (sys.executable, "-P", "-m", "pip", "--disable-pip-version-check")


@dataclass(frozen=True, slots=True)
class Own:
    """A folder, or a wheel, of the checkout: `plugins/sdk`, `.[fast]`, `dist/it-1.0-….whl`."""

    path: Path
    extras: tuple[str, ...] = ()
    is_editable: bool = False

    @classmethod
    def parse(cls, word: str, *, is_editable: bool = False) -> Own:
        """
        >>> Own.parse("./plugins/sdk[usb,more]").extras
        ('usb', 'more')
        """
        path, _, extras = word.rstrip("]").partition("[")
        return cls(Path(path).resolve(), tuple(filter(None, extras.split(","))), is_editable)

    def foreign(self) -> Iterable[str]:
        """What it asks for, to be built and to run."""
        if self.path.is_dir():
            yield from asked.of_distribution(self.path, self.extras)
        if self.is_editable:
            yield asked.EDITABLE


def install(
    own: Sequence[Own], groups: Iterable[str], requirements: Iterable[str], *, keep: bool = False
) -> None:
    """Install these; with `keep`, what of the checkout is installed already is left as it is.

    Raises `SetUpFailed`, with nothing of the checkout installed, if something is not in the lock,
    or is not what the lock says; `DoesNotFit` if what is installed then does not fit."""
    wanted = [line for each in own for line in each.foreign()]
    wanted += [line for group in groups for line in asked.of_group(CHECKOUT, group)]
    _foreign([*wanted, *requirements])
    there = _installed() if keep else frozenset()
    _own([each for each in own if each.path.is_file() or asked.name_in(each.path) not in there])
    _check()


def _foreign(requirements: Iterable[str]) -> None:
    names = {asked.name_of(line) for line in requirements} - asked.own_names(CHECKOUT)
    entries = lockfile.parse(LOCK.read_text(encoding="utf-8"))
    if absent := names - {entry.name for entry in entries}:
        raise SetUpFailed(f"{LOCK_NAME} does not have {', '.join(sorted(absent))}: `./run lock`")
    needed = lockfile.needed(entries, names)
    chosen = [entry for entry in entries if entry.name in needed]
    _locked([entry for entry in chosen if entry.name not in OVERRULED])
    if beside := [entry for entry in chosen if entry.name in OVERRULED]:
        _remove(entry.name for entry in beside)
        _locked(beside, "--upgrade", "--target", str(BESIDE))


def _locked(entries: Sequence[lockfile.Entry], *words: str) -> None:
    if not entries:
        return
    with tempfile.NamedTemporaryFile("w", suffix=".txt", encoding="utf-8") as file:
        file.writelines(entry.text for entry in entries)
        file.flush()
        _install("--require-hashes", "--no-deps", *words, "-r", file.name)


def _remove(names: Iterable[str]) -> None:
    """Take these out of the environment, where they were before they were put beside it."""
    if known := sorted(_installed() & set(names)):
        subprocess.run(
            (*PIP, "-q", "uninstall", "-y", *known), stdin=subprocess.DEVNULL, check=False
        )


def _installed() -> frozenset[str]:
    """The names of all distributions in the environment."""
    return frozenset(lockfile.canonical(found.name) for found in metadata.distributions())


def _own(own: Sequence[Own]) -> None:
    if own:
        words = (word for each in own for word in (*["-e"] * each.is_editable, str(each.path)))
        # A wheel that was built again may have the version of the one that is installed.
        held = ("--no-deps", "--no-index", "--no-build-isolation", "--force-reinstall")
        _install(*held, *words)


def _check() -> None:
    done = subprocess.run(
        (*PIP, "check"), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    )
    if flaws := Checked(done.returncode, done.stdout).flaws(asked.own_names(CHECKOUT)):
        raise DoesNotFit(
            f"what is installed in {sys.prefix} does not fit together: {' '.join(flaws)} If the "
            "lock says so, lock what fits (`./run lock`); else delete that folder: it is made again"
        )


def _install(*words: str) -> None:
    if subprocess.run((*PIP, "-q", "install", *words), stdin=subprocess.DEVNULL).returncode != 0:
        raise SetUpFailed(
            f"pip has not installed what {LOCK_NAME} says; its words are above. If they speak of "
            "hashes, a package is not the one that was locked: find out why before you go on, and "
            "only then lock what there is now (`./run lock`)"
        )
