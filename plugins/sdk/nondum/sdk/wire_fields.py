"""Fields of packets that strangers send, whichever link carries them."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from nondum.sdk.codec.checks import Bounds, Mismatch
from nondum.sdk.codec.values import reader
from nondum.sdk.errors import Problem
from nondum.sdk.packet_codec import violation

MAX_NAME = 64
"""Characters in a verb or an event's name."""
MAX_ID = 2**53

Number: TypeAlias = Annotated[int, Bounds(1, MAX_ID)]
"""A positive whole number."""
Name: TypeAlias = Annotated[str, Bounds(1, MAX_NAME)]
"""A short name."""


def read_problem(data: object) -> Problem:
    """A problem that is told. Raises `ProtocolViolation` (PACKET_FIELDS)."""
    problem: Problem = read_field(Problem, data)
    return problem


def read_field(hint: Any, data: object) -> Any:
    """One field of a packet, as its type says. Raises `ProtocolViolation` (PACKET_FIELDS)."""
    try:
        return reader(hint)(data)
    except Mismatch as mismatch:
        raise violation(mismatch) from None
