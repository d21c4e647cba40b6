"""A piece of a catalogue on its way: of the whole, or of what changed between two revisions. Pure.

Entries travel packed, each for itself: the digest is over exactly the bytes that the owner packed,
and packing is done once, however many peers there are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from hashlib import blake2b
from typing import Any, TypeAlias

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.wire import Body, unpack
from nondum.sdk.wire_fields import Number, read_field
from nondum.transport.peers.messages import MAX_MESSAGE
from nondum.transport.peers.pulse import DIGEST_BYTES, State

MAX_KEY = 256
"""Bytes in the key of an entry."""
MAX_ENTRY = MAX_MESSAGE - 2048
"""Bytes in a packed entry: it fits a message with its key and the envelope."""
MAX_CATALOGUE = 4 << 20
"""Bytes of all keys and packed entries of a host."""
MAX_PARTS = 128
"""Messages that changes may take: those of a full catalogue and of what was in it before."""
_MOST_BYTES = MAX_MESSAGE - 1024
"""Bytes of keys and packed entries in one message."""
_FRAMING = 16
"""Bytes that msgpack adds to a key and a value, and some; a message's table has few enough so."""

Packed: TypeAlias = Mapping[str, bytes | None]
"""Changes: packed entries by key, None for one that is gone."""


@frozen
class Chunk:
    """One of `parts` messages that lead from one revision of a catalogue to another."""

    epoch: int
    """Of the host whose catalogue it is."""
    since: int
    """The revision that the changes start from; 0 for nothing: they are the whole then."""
    state: State
    """What they lead to."""
    part: int
    """From 0."""
    parts: int
    changes: Packed

    def to_body(self) -> dict[str, Any]:
        """The chunk as plain data."""
        return {
            "epoch": self.epoch,
            "since": self.since,
            "revision": self.state.revision,
            "digest": self.state.digest,
            "part": self.part,
            "parts": self.parts,
            "changes": self.changes,
        }


def parse(body: Body) -> Chunk:
    """Read a chunk that a peer sent. Raises `ProtocolViolation` (CHUNK_FIELDS, PACKET_FIELDS)."""
    if body.keys() != _FIELDS:
        raise _violation(f"a chunk has {', '.join(sorted(_FIELDS))}")
    since, part, parts = body["since"], body["part"], body["parts"]
    if not all(type(number) is int for number in (since, part, parts)):
        raise _violation("since, part and parts are whole numbers")
    if not 0 <= part < parts <= MAX_PARTS:
        raise _violation(f"part {part!r:.20} of {parts!r:.20}: at most {MAX_PARTS} are taken")
    state = read_state(body)
    if not 0 <= since <= state.revision:
        raise _violation("changes lead from a revision to a later one")
    changes = body["changes"]
    if type(changes) is not dict or not all(map(_is_change, changes.items())):
        raise _violation("changes are packed entries by short keys")
    return Chunk(read_field(Number, body["epoch"]), since, state, part, parts, changes)


def read_state(body: Body) -> State:
    """Read revision and digest. Raises `ProtocolViolation`."""
    digest = body.get("digest")
    if type(digest) is not bytes or len(digest) != DIGEST_BYTES:
        raise _violation(f"a digest has {DIGEST_BYTES} bytes")
    return State(read_field(Number, body.get("revision")), digest)


def read_entry(packed: bytes) -> Body:
    """Unpack one entry. Raises `ProtocolViolation`."""
    entry = unpack(packed, MAX_ENTRY)
    if type(entry) is not dict:
        raise _violation("an entry is a table")
    return entry


def cut(epoch: int, since: int, state: State, changes: Packed) -> tuple[Chunk, ...]:
    """Cut changes into as many chunks as it takes; at least one, so that no change is told too."""
    tables = list(_tables(changes.items())) or [{}]
    return tuple(
        Chunk(epoch, since, state, part, len(tables), table) for part, table in enumerate(tables)
    )


def size(key: str, packed: bytes) -> int:
    """Bytes that an entry counts for."""
    return len(key.encode()) + len(packed) + _FRAMING


def digest_of(key: str, packed: bytes) -> int:
    """What an entry adds to the digest of a catalogue: these are combined by exclusive or."""
    name = key.encode()
    hashed = blake2b(b"%d:%b%b" % (len(name), name, packed), digest_size=DIGEST_BYTES)
    return int.from_bytes(hashed.digest())


def _tables(changes: Iterable[tuple[str, bytes | None]]) -> Iterator[dict[str, bytes | None]]:
    table: dict[str, bytes | None] = {}
    filled = 0
    for key, packed in changes:
        needed = size(key, packed or b"")
        if table and filled + needed > _MOST_BYTES:
            yield table
            table, filled = {}, 0
        table[key] = packed
        filled += needed
    if table:
        yield table


_FIELDS = frozenset({"epoch", "since", "revision", "digest", "part", "parts", "changes"})


def _is_change(item: tuple[Any, Any]) -> bool:
    key, packed = item
    return len(key.encode()) <= MAX_KEY and (packed is None or type(packed) is bytes)


def _violation(message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem("CHUNK_FIELDS", message))
