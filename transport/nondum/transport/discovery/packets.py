"""The question "who is there?" and its answer, each one datagram. Pure.

A question carries 16 random bytes, which only a host that received it can send back. It is padded
to the length of the longest answer, so that hosts cannot be used to amplify traffic.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgpack

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.wire_fields import MAX_NAME
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.hint import to_txt

LENGTH = 512
"""Bytes in a question; an answer has no more."""
NONCE = 16
MAX_FIELDS = 16
_QUESTION = b"nondum?1"
_ANSWER = b"nondum!1"


@frozen
class Answer:
    """What a host answers, as it was received: `hint.from_txt` judges the fields."""

    nonce: bytes
    port: int
    txt: Mapping[str, str]


def question(nonce: bytes) -> bytes:
    """Ask who is there.

    >>> len(question(bytes(16)))
    512
    """
    return (_QUESTION + nonce).ljust(LENGTH, b"\0")


def nonce_of(data: bytes) -> bytes | None:
    """What makes a question this one; None when it is no question, or a short one.

    >>> nonce_of(question(bytes(16))) == bytes(16), nonce_of(b"nondum?1")
    (True, None)
    """
    if len(data) != LENGTH or not data.startswith(_QUESTION):
        return None
    start = len(_QUESTION)
    return data[start : start + NONCE]


def answer(nonce: bytes, announcement: Announcement) -> bytes:
    """Tell who is here."""
    body: bytes = msgpack.packb([announcement.port, to_txt(announcement)])
    return _ANSWER + nonce + body


def read_answer(data: bytes) -> Answer:
    """Read an answer. Raises `ProtocolViolation` (HINT_MALFORMED)."""
    start = len(_ANSWER) + NONCE
    if not data.startswith(_ANSWER) or len(data) > LENGTH:
        raise _malformed()
    try:
        fields = msgpack.unpackb(
            data[start:],
            max_array_len=2,
            max_map_len=MAX_FIELDS,
            max_str_len=LENGTH,
            max_bin_len=0,
            max_ext_len=0,
        )
    except Exception as error:  # msgpack raises what it likes
        raise _malformed() from error
    match fields:
        case [int(port), dict(txt)] if all(_is_field(*field) for field in txt.items()):
            return Answer(data[len(_ANSWER) : start], port, txt)
    raise _malformed()


def _is_field(key: object, value: object) -> bool:
    return type(key) is str and len(key) <= MAX_NAME and type(value) is str


def _malformed() -> ProtocolViolation:
    return ProtocolViolation(Problem("HINT_MALFORMED", "the datagram is no answer"))
