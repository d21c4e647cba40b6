"""Reading the fields of packets that strangers sent, whichever link carried them."""

from __future__ import annotations

from typing import Any

from nondum.sdk.errors import Problem, ProtocolViolation

MAX_NAME = 64
"""Characters in a verb or an event's name."""
MAX_ID = 2**53

_PROBLEM_KEYS = frozenset({"code", "message", "where", "need", "have", "fix"})


def read_problem(data: object) -> Problem:
    """A problem that is told. Raises `ProtocolViolation` (PACKET_FIELDS)."""
    if (
        not isinstance(data, dict)
        or not {"code", "message"} <= data.keys() <= _PROBLEM_KEYS
        or not all(type(text) is str for text in data.values())
    ):
        raise _violation("PACKET_FIELDS", "a problem is a table of texts with code and message")
    return Problem(**data)


def read_number(value: object) -> int:
    """A positive whole number. Raises `ProtocolViolation` (PACKET_FIELDS)."""
    if type(value) is not int or not 0 < value <= MAX_ID:
        raise _violation("PACKET_FIELDS", f"expected a positive whole number, found {value!r:.40}")
    return value


def read_text(value: object) -> str:
    """A short name. Raises `ProtocolViolation` (PACKET_FIELDS)."""
    if type(value) is not str or not 0 < len(value) <= MAX_NAME:
        raise _violation("PACKET_FIELDS", f"expected a short name, found {value!r:.40}")
    return value


def read_body(value: object) -> dict[str, Any]:
    """A table. Raises `ProtocolViolation` (PACKET_FIELDS)."""
    if type(value) is not dict:
        raise _violation("PACKET_FIELDS", f"expected a table, found {type(value).__name__}")
    return value


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
