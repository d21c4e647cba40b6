"""What peers say to each other: one msgpack list per message, its kind first, with strict limits.

Pure: values in, bytes out, and back. Whatever a hostile peer sends, `decode` gives a `Message` or
raises `ProtocolViolation`. The first two kinds never change, so that any two versions can agree on
a version, or part with a reason.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.wire import Body, pack, unpack
from nondum.sdk.wire_fields import (
    MAX_ID,
    read_body,
    read_number,
    read_problem,
    read_text,
)
from nondum.transport.peers.pulse import DIGEST_BYTES, State

VERSIONS: tuple[int, ...] = (2, 1)
"""Versions of this protocol that this host speaks, newest first. 2 adds `Ask` and `Vouch`."""
MAX_MESSAGE = 128 * 1024
"""Bytes in a message."""
MAX_CERTIFICATE = 1024


@dataclass(frozen=True, slots=True)
class Hello:
    """The first message of the host that dialled, and, as `Welcome`, the answer to it."""

    versions: tuple[int, ...]
    name: str
    key: str
    """The sender's public key; the link must prove the same one."""
    epoch: int
    """Drawn at random when the sender started."""
    term: int
    """How often the sender has given up links to this peer in this epoch, plus one."""
    certificate: bytes
    """Empty for none."""


@dataclass(frozen=True, slots=True)
class Welcome:
    """The answer to a hello: the same of the other end, with the one version to speak."""

    hello: Hello


@dataclass(frozen=True, slots=True)
class Refused:
    """The last message before a link is cut: why."""

    problem: Problem


@dataclass(frozen=True, slots=True)
class Request:
    """A call; answered once, by `Reply` or `Failure` with the same number."""

    number: int
    settled: int
    """The caller has the answers of all its calls below this number."""
    remaining_ms: int
    """How long the caller will still wait: clocks differ, so never a time of day."""
    method: str
    args: Body


@dataclass(frozen=True, slots=True)
class Reply:
    """A call was carried out."""

    number: int
    body: Body


@dataclass(frozen=True, slots=True)
class Failure:
    """A call failed, or was halted."""

    number: int
    problems: tuple[Problem, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a call is; may be lost."""

    number: int
    body: Body


@dataclass(frozen=True, slots=True)
class Cancel:
    """Halt a call; it is still answered."""

    number: int


@dataclass(frozen=True, slots=True)
class Notice:
    """Something worth knowing; not answered, and never repeated."""

    method: str
    args: Body


@dataclass(frozen=True, slots=True)
class Ping:
    """The sender's loop is working."""

    number: int
    beat_ms: int = 300
    """Until the next one."""
    state: State | None = None
    """How far the sender's account of itself is; two more fields, or none."""


@dataclass(frozen=True, slots=True)
class Pong:
    """A ping came; not every one is answered."""

    number: int


@dataclass(frozen=True, slots=True)
class Bye:
    """The sender is going, and means to."""

    reason: str


@dataclass(frozen=True, slots=True)
class Ask:
    """Whether a host answers that the sender does not hear (SWIM's ping-req)."""

    number: int
    key: str
    """Of the host in question."""


@dataclass(frozen=True, slots=True)
class Vouch:
    """The host that was asked about has answered the sender; nothing is said when it has not."""

    number: int


Message: TypeAlias = (
    Hello
    | Welcome
    | Refused
    | Request
    | Reply
    | Failure
    | Progress
    | Cancel
    | Notice
    | Ping
    | Pong
    | Bye
    | Ask
    | Vouch
)


def encode(message: Message) -> bytes:
    """Make the bytes of a message.

    Raises `ProtocolViolation` for what the other end would refuse (too long, too deep, NaN) and
    `TypeError` for values that are no plain data.
    """
    match message:
        case Request(number, settled, remaining_ms, method, args):
            fields: tuple[Any, ...] = (3, number, settled, remaining_ms, method, args)
        case Reply(number, body):
            fields = (4, number, body)
        case Ping(number, beat_ms, None):
            fields = (9, number, beat_ms)
        case Ping(number, beat_ms, State(revision, digest)):
            fields = (9, number, beat_ms, revision, digest)
        case Pong(number):
            fields = (10, number)
        case Failure(number, problems):
            fields = (5, number, [problem.to_dict() for problem in problems])
        case Progress(number, body):
            fields = (6, number, body)
        case Cancel(number):
            fields = (7, number)
        case Notice(method, args):
            fields = (8, method, args)
        case Hello():
            fields = (0, *_greeting(message))
        case Welcome(hello):
            fields = (1, *_greeting(hello))
        case Refused(problem):
            fields = (2, problem.to_dict())
        case Bye(reason):
            fields = (11, reason)
        case Ask(number, key):
            fields = (12, number, key)
        case Vouch(number):
            fields = (13, number)
    return pack(fields, MAX_MESSAGE)


def decode(data: bytes | memoryview) -> Message:
    """Read a message. Raises `ProtocolViolation` for anything that is not one exact message."""
    fields = unpack(data, MAX_MESSAGE)
    if not isinstance(fields, list) or not fields or type(fields[0]) is not int:
        raise _violation("PACKET_KIND", "a message is a list that begins with its kind")
    if not 0 <= fields[0] < len(_READERS):
        raise _violation("PACKET_KIND", f"no kind of message has the number {fields[0]}")
    lengths, read = _READERS[fields[0]]
    if len(fields) not in lengths:
        expected = " or ".join(map(str, lengths))
        raise _violation(
            "PACKET_FIELDS", f"kind {fields[0]} has {expected} fields, found {len(fields)}"
        )
    return read(fields)


def agreed_version(hello: Hello) -> int:
    """The newest version that both ends speak.

    >>> agreed_version(Hello((3, 2, 1), "rover", "", 1, 1, b""))
    2

    Raises `ProtocolViolation` (PROTO_VERSION).
    """
    common = set(hello.versions) & set(VERSIONS)
    if not common:
        raise ProtocolViolation(
            Problem(
                "PROTO_VERSION",
                "the peer speaks no version of the protocol that this host speaks",
                where=hello.name,
                need=" or ".join(map(str, VERSIONS)),
                have=", ".join(map(str, hello.versions)),
                fix="update the older of the two hosts",
            )
        )
    return max(common)


def _greeting(hello: Hello) -> tuple[Any, ...]:
    return hello.versions, hello.name, hello.key, hello.epoch, hello.term, hello.certificate


def _read_hello(fields: list[Any]) -> Hello:
    versions, certificate = fields[1], fields[6]
    if not isinstance(versions, list) or not 0 < len(versions) <= 16:
        raise _violation("PACKET_FIELDS", "versions are a short list of whole numbers")
    if type(certificate) is not bytes or len(certificate) > MAX_CERTIFICATE:
        raise _violation("PACKET_FIELDS", f"a certificate has up to {MAX_CERTIFICATE} bytes")
    return Hello(
        tuple(read_number(v) for v in versions),
        read_text(fields[2]),
        read_text(fields[3]),
        read_number(fields[4]),
        read_number(fields[5]),
        certificate,
    )


def _read_welcome(fields: list[Any]) -> Welcome:
    hello = _read_hello(fields)
    if len(hello.versions) != 1:
        raise _violation("PACKET_FIELDS", "a welcome names the one version to speak")
    return Welcome(hello)


def _read_refused(fields: list[Any]) -> Refused:
    return Refused(read_problem(fields[1]))


def _read_request(fields: list[Any]) -> Request:
    _, number, settled, remaining_ms, method, args = fields
    return Request(
        read_number(number),
        read_number(settled),
        read_number(remaining_ms),
        read_text(method),
        read_body(args),
    )


def _read_reply(fields: list[Any]) -> Reply:
    return Reply(read_number(fields[1]), read_body(fields[2]))


def _read_failure(fields: list[Any]) -> Failure:
    problems = fields[2]
    if not isinstance(problems, list) or not 0 < len(problems) <= 64:
        raise _violation("PACKET_FIELDS", "a failure names between one and 64 problems")
    return Failure(read_number(fields[1]), tuple(read_problem(problem) for problem in problems))


def _read_progress(fields: list[Any]) -> Progress:
    return Progress(read_number(fields[1]), read_body(fields[2]))


def _read_cancel(fields: list[Any]) -> Cancel:
    return Cancel(read_number(fields[1]))


def _read_notice(fields: list[Any]) -> Notice:
    return Notice(read_text(fields[1]), read_body(fields[2]))


def _read_ping(fields: list[Any]) -> Ping:
    number, beat_ms = read_number(fields[1]), read_number(fields[2])
    if len(fields) == 3:
        return Ping(number, beat_ms)
    digest = fields[4]
    if type(digest) is not bytes or len(digest) != DIGEST_BYTES:
        raise _violation("PACKET_FIELDS", f"a digest has {DIGEST_BYTES} bytes")
    return Ping(number, beat_ms, State(read_number(fields[3]), digest))


def _read_pong(fields: list[Any]) -> Pong:
    return Pong(read_number(fields[1]))


def _read_bye(fields: list[Any]) -> Bye:
    return Bye(read_text(fields[1]))


def _read_ask(fields: list[Any]) -> Ask:
    return Ask(read_number(fields[1]), read_text(fields[2]))


def _read_vouch(fields: list[Any]) -> Vouch:
    return Vouch(read_number(fields[1]))


_READERS: tuple[tuple[tuple[int, ...], Callable[[list[Any]], Message]], ...] = (
    ((7,), _read_hello),
    ((7,), _read_welcome),
    ((2,), _read_refused),
    ((6,), _read_request),
    ((3,), _read_reply),
    ((3,), _read_failure),
    ((3,), _read_progress),
    ((2,), _read_cancel),
    ((3,), _read_notice),
    ((3, 5), _read_ping),
    ((2,), _read_pong),
    ((2,), _read_bye),
    ((3,), _read_ask),
    ((2,), _read_vouch),
)
"""By kind: how many fields a message has, and how they are read."""


def milliseconds(seconds: float) -> int:
    """A duration for the wire: whole, at least one, at most what a number may be.

    >>> milliseconds(0.25), milliseconds(-3), milliseconds(float("inf"))
    (250, 1, 9007199254740992)
    """
    return MAX_ID if math.isinf(seconds) else min(MAX_ID, max(1, round(seconds * 1000)))


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
