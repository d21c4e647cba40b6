"""What is known of one peer's catalogue in one life of that peer. Pure.

Chunks may come twice, late, out of order or not at all: what they cannot bring is asked for again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.wire import Body
from nondum.transport.fleet.chunk import MAX_CATALOGUE, Chunk, Packed, digest_of, read_entry, size
from nondum.transport.peers.pulse import DIGEST_BYTES, State


@frozen
class Change:
    """What chunks have brought."""

    changes: Mapping[str, Body | None]
    is_whole: bool


@frozen
class _Copy:
    """The catalogue at one revision, with what each entry adds to its digest and its size."""

    entries: Mapping[str, Body] = field(default_factory=dict)
    weights: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    digest: int = 0
    size: int = 0


class Replica:
    """A copy of a peer's ledger, as far as it was heard."""

    def __init__(self, epoch: int) -> None:
        self.epoch = epoch
        self.revision = 0
        """0 before the whole was heard."""
        self._copy = _Copy()
        self._heard = 1
        """The highest revision that was told of: no ledger is below 1."""
        self._is_wrong = False
        self._parts: dict[int, Chunk] = {}
        """What has come of changes that take several messages."""

    @property
    def entries(self) -> Mapping[str, Body]:
        """The catalogue. Never changed: the next revision is another mapping."""
        return self._copy.entries

    @property
    def must_ask(self) -> bool:
        """Whether something is missing that only asking is sure to bring."""
        return self._is_wrong or self._heard > self.revision

    @property
    def since(self) -> int:
        """The revision to ask for changes from; 0 when the whole is needed."""
        return 0 if self._is_wrong else self.revision

    def hear(self, state: State) -> None:
        """The peer told how far its ledger is."""
        self._heard = max(self._heard, state.revision)
        if state.revision == self.revision and state.digest != _bytes(self._copy.digest):
            self._is_wrong = True

    def take(self, chunk: Chunk) -> Change | None:
        """Take a chunk in; what it changes, once all parts of its changes have come.

        Raises `ProtocolViolation` for what no ledger sends; nothing is changed then.
        """
        if chunk.epoch != self.epoch:
            return None
        self.hear(chunk.state)
        if not self._leads_on(chunk):
            return None
        changes = self._complete(chunk)
        return None if changes is None else self._apply(chunk, changes)

    def _leads_on(self, chunk: Chunk) -> bool:
        """Whether it begins at or before what is here, and ends after it."""
        if self._is_wrong:
            return chunk.since == 0 and chunk.state.revision >= self.revision
        return chunk.since <= self.revision < chunk.state.revision

    def _complete(self, chunk: Chunk) -> Packed | None:
        """All changes, when this was the last part of them to come."""
        if chunk.parts == 1:
            return chunk.changes
        begun = next(iter(self._parts.values()), None)
        if begun is None or _of_all(begun) != _of_all(chunk):
            if begun is not None and begun.state.revision > chunk.state.revision:
                return None
            self._parts = {}
        self._parts[chunk.part] = chunk
        if len(self._parts) < chunk.parts:
            return None
        parts, self._parts = self._parts, {}
        return {key: new for part in parts.values() for key, new in part.changes.items()}

    def _apply(self, chunk: Chunk, packed: Packed) -> Change | None:
        is_whole = chunk.since == 0
        changes = {key: None if new is None else read_entry(new) for key, new in packed.items()}
        copy = _changed(_Copy() if is_whole else self._copy, packed, changes)
        if _bytes(copy.digest) != chunk.state.digest:
            if is_whole:
                raise _violation("the digest of a catalogue is not that of its entries")
            self._is_wrong = True
            return None
        if copy.size > MAX_CATALOGUE:
            raise _violation(f"a catalogue has more than {MAX_CATALOGUE} bytes")
        self._copy, self.revision, self._is_wrong = copy, chunk.state.revision, False
        return Change(changes, is_whole)


def _changed(old: _Copy, packed: Packed, changes: Mapping[str, Body | None]) -> _Copy:
    entries, weights = dict(old.entries), dict(old.weights)
    digest, total = old.digest, old.size
    for key, new in packed.items():
        entries.pop(key, None)
        weight, length = weights.pop(key, (0, 0))
        digest, total = digest ^ weight, total - length
        entry = changes[key]
        if new is not None and entry is not None:
            entries[key], weights[key] = entry, (digest_of(key, new), size(key, new))
            digest, total = digest ^ weights[key][0], total + weights[key][1]
    return replace(old, entries=entries, weights=weights, digest=digest, size=total)


def _of_all(chunk: Chunk) -> tuple[int, State, int]:
    """What all parts of the same changes have in common."""
    return chunk.since, chunk.state, chunk.parts


def _bytes(digest: int) -> bytes:
    return digest.to_bytes(DIGEST_BYTES)


def _violation(message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem("CHUNK_FIELDS", message))
