"""This host's catalogue as its peers are told it: entries, revisions, and what is gone. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body, pack
from nondum.transport.fleet.chunk import (
    MAX_CATALOGUE,
    MAX_ENTRY,
    MAX_KEY,
    Chunk,
    cut,
    digest_of,
    size,
)
from nondum.transport.fleet.failures import EntryRefused
from nondum.transport.peers.pulse import DIGEST_BYTES, State

REMEMBERED = 4096
"""Removed entries whose removal can still be told; who missed more reads the whole."""


class Ledger:
    """Entries by key, packed, in the order of their last change."""

    def __init__(self, epoch: int, remembered: int = REMEMBERED) -> None:
        self.epoch = epoch
        self._remembered = remembered
        self._revision = 1
        self._oldest = 1
        """Changes since this revision are known."""
        self._entries: dict[str, bytes] = {}
        self._changed: dict[str, int] = {}
        """Key → revision of its last change, oldest first; of removed entries too."""
        self._size = 0
        self._digest = 0

    @property
    def state(self) -> State:
        """Revision 1 is the empty catalogue of the start."""
        return State(self._revision, self._digest.to_bytes(DIGEST_BYTES))

    @property
    def remembered(self) -> int:
        """How many entries, and removals that can still be told, it holds."""
        return len(self._changed)

    def publish(self, changes: Mapping[str, Body | None]) -> bool:
        """Take changes over as one revision; whether there were any.

        Raises `EntryRefused` (ENTRY_TOO_LONG, ENTRY_KEY, CATALOGUE_TOO_LONG), `ProtocolViolation`
        and `TypeError` for what is no plain data; nothing is changed then.
        """
        packed = {key: _pack(key, entry) for key, entry in changes.items()}
        changed = {key: new for key, new in packed.items() if new != self._entries.get(key)}
        if not changed:
            return False
        grown = self._size + sum(self._growth(key, new) for key, new in changed.items())
        if grown > MAX_CATALOGUE:
            raise EntryRefused(_all_too_long(grown))
        self._size = grown
        self._revision += 1
        for key, new in changed.items():
            self._replace(key, new)
        self._forget()
        return True

    def whole(self) -> tuple[Chunk, ...]:
        """All of it."""
        return cut(self.epoch, 0, self.state, self._entries)

    def delta(self, since: int) -> tuple[Chunk, ...] | None:
        """What changed after a revision; None when that is too long ago, or yet to come."""
        if not self._oldest <= since <= self._revision:
            return None
        changes: dict[str, bytes | None] = {}
        for key, revision in reversed(self._changed.items()):
            if revision <= since:
                break
            changes[key] = self._entries.get(key)
        return cut(self.epoch, since, self.state, changes)

    def read(self, epoch: int, since: int) -> tuple[Chunk, ...]:
        """What a peer needs that knows a revision of an epoch; the whole when it knows neither."""
        known = self.delta(since) if epoch == self.epoch and since else None
        return self.whole() if known is None else known

    def _growth(self, key: str, new: bytes | None) -> int:
        old = self._entries.get(key)
        return (0 if new is None else size(key, new)) - (0 if old is None else size(key, old))

    def _replace(self, key: str, new: bytes | None) -> None:
        old = self._entries.pop(key, None)
        if old is not None:
            self._digest ^= digest_of(key, old)
        if new is not None:
            self._entries[key] = new
            self._digest ^= digest_of(key, new)
        self._changed.pop(key, None)
        self._changed[key] = self._revision

    def _forget(self) -> None:
        """Let go of the oldest removals, when there are too many."""
        excess = len(self._changed) - len(self._entries) - self._remembered
        if excess <= 0:
            return
        gone = [key for key in self._changed if key not in self._entries][:excess]
        for key in gone:
            self._oldest = self._changed.pop(key)


def _pack(key: str, entry: Body | None) -> bytes | None:
    try:
        is_key = 0 < len(key.encode()) <= MAX_KEY
    except UnicodeEncodeError:  # half a surrogate pair
        is_key = False
    if not is_key:
        raise EntryRefused(_bad_key(key))
    if entry is None:
        return None
    packed = pack(entry, MAX_CATALOGUE)
    if len(packed) > MAX_ENTRY:
        raise EntryRefused(_too_long(key, len(packed)))
    return packed


def _bad_key(key: str) -> Problem:
    return Problem(
        "ENTRY_KEY", f"the key of an entry has one to {MAX_KEY} bytes", where=f"{key[:60]!a}"
    )


def _too_long(key: str, length: int) -> Problem:
    return Problem(
        "ENTRY_TOO_LONG",
        "an entry of the catalogue is longer than a message between hosts may be",
        where=key,
        need=f"{length} bytes",
        have=f"{MAX_ENTRY} bytes",
        fix="split what it tells into several entries",
    )


def _all_too_long(length: int) -> Problem:
    return Problem(
        "CATALOGUE_TOO_LONG",
        "the catalogue is longer than peers would take",
        need=f"{length} bytes",
        have=f"{MAX_CATALOGUE} bytes",
    )
