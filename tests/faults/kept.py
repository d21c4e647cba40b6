"""What a host keeps beside its catalogue: written by a daemon that is tried, looked for afterwards.

A daemon that keeps something tells so in its file `told`, as it does of commits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from tests.kit.lamp_drive import told as ignored
from tests.kit.signing import Key, signed, trust_of

from nondum.host.catalogue.backups import Backups
from nondum.host.lifecycle import rebuilding
from nondum.host.manager.crash_loop import CrashCounter
from nondum.host.manager.state_folders import Folders
from nondum.host.peers.trust_store import KEY_NAME, TRUST_NAME
from nondum.host.trust import chain
from nondum.transport.peers import HostKeys, Trust, trust_file
from nondum.transport.peers.keys import load_or_create
from nondum.wheelhouse.trust import trust_text

WORD = "kept"
ROOT_KEY = Key("root")
FIRST = trust_of(roots=[ROOT_KEY])


def keep(folders: Folders, nth: int) -> Iterator[Path]:
    """Write all of it, for the nth time (from 1); gives each file once it is promised."""
    yield from _trust(folders, nth)
    yield from _peers(folders, nth)
    note = folders.note(f"{nth:016x}")
    rebuilding.write_note(note, "a", folders.payloads / note.stem)
    yield note
    CrashCounter(folders.root).begin()
    yield folders.root / "deaths"
    backups = Backups(folders.catalogue)
    backups.make()
    yield backups.newest


def _trust(folders: Folders, nth: int) -> Iterator[Path]:
    """The next trust file, which follows the one before."""
    versions = [replace(FIRST, version=version) for version in range(1, nth + 2)]
    files = [signed(version, ROOT_KEY) for version in versions]
    said = chain.extend(
        {
            "folder": str(folders.trust),
            "known": [file.digest for file in files[:-1]],
            "trust": trust_text.to_text(versions[-2]),
            "offered": chain.packed((files[-1],)),
        },
        ignored,
    )
    assert said["taken"] == [nth + 1]
    yield folders.trust / f"{nth + 1:08d}.toml"
    yield folders.trust / f"{nth + 1:08d}.toml.sig"


def _peers(folders: Folders, nth: int) -> Iterator[Path]:
    """A key, made once; one more host that is trusted, then revoked."""
    load_or_create(folders.peers / KEY_NAME)
    yield folders.peers / KEY_NAME
    path = folders.peers / TRUST_NAME
    trust = trust_file.load(path) if nth > 1 else Trust()
    other = HostKeys.generate().public
    for changed in (trust.with_paired(other, f"rover-{nth}"), trust.with_revoked(other, "lost")):
        trust_file.save(path, changed)
        yield path


def lines(paths: Iterator[Path], root: Path) -> Iterator[str]:
    """What is told of each."""
    for path in paths:
        yield f"{WORD} {path.relative_to(root)} {_hash(path)}"


def lost(root: Path, state: Path, log: int) -> Iterator[str]:
    """What was promised while the disk's log was no longer than that, and is not in the folder:
    neither as it was last promised, nor as it was afterwards."""
    promised: dict[str, list[tuple[str, int]]] = {}
    for line in (root / "told").read_text().splitlines():
        match line.split():
            case [word, name, digest, length] if word == WORD:
                promised.setdefault(name, []).append((digest, int(length)))
    for name, versions in promised.items():
        before = [n for n, (_, length) in enumerate(versions) if length <= log]
        if before:
            path = state / name
            have = _hash(path) if path.exists() else "nothing"
            if have not in {digest for digest, _ in versions[before[-1] :]}:
                yield f"{name} was promised and is lost"


def moments(root: Path) -> list[int]:
    """How long the disk's log was whenever something was promised, in order."""
    told = (root / "told").read_text().splitlines()
    said = (line.split() for line in told)
    return sorted({int(words[-1]) for words in said if words[0] in (WORD, "committed")})


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
