"""Trust files that a drive carries from their owner to its robots.

    <drive>/nondum-trust/<any>.toml        a version of the trust file
    <drive>/nondum-trust/<any>.toml.sig    its roots' signatures

A drive may carry many versions, for robots that have not seen one for long. Names that begin with a
dot are what systems leave on sticks (`._<any>.toml`), and mean nothing.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from pathlib import Path

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse.payload import drive
from nondum.wheelhouse.trust import sshsig, trust_file
from nondum.wheelhouse.trust.succession import SignedFile

FOLDER = "nondum-trust"
SUFFIX, SIGNATURE_SUFFIX = ".toml", ".sig"
MOST_FILES = 64
MOST_ENTRIES = 1000


def trust_files_on(root: Path) -> tuple[tuple[SignedFile, ...], tuple[Problem, ...]]:
    """The trust files on a drive, unread as yet, and what is wrong with those that cannot be had.

    Raises `DriveGone`.
    """
    folder = root / FOLDER
    found: list[SignedFile] = []
    problems: list[Problem] = []
    for name in itertools.islice(_names(folder), MOST_FILES):
        try:
            data = drive.read_small(folder, name, trust_file.MAX_BYTES)
            signature = drive.read_small(folder, name + SIGNATURE_SUFFIX, sshsig.MAX_BYTES)
        except PayloadRefused as refused:
            problems.extend(refused.problems)
            continue
        if data is not None:
            found.append(SignedFile(data, signature, f"{FOLDER}/{name}"))
    return tuple(found), tuple(problems)


def _names(folder: Path) -> Iterator[str]:
    try:
        if folder.is_symlink():
            return
        with os.scandir(folder) as entries:
            names = sorted(entry.name for entry in itertools.islice(entries, MOST_ENTRIES))
    except OSError:  # most drives have none
        return
    shown = (n for n in names if n.isascii() and n.isprintable() and not n.startswith("."))
    yield from (n for n in shown if n.endswith(SUFFIX))
