"""What a request is about and what comes of it, as the body of a message of a worker link.

Both are plain data that is packed for itself: the limits of a link's packets are for strangers, and
names of files need be no UTF-8. A refusal carries the class of its error, which a `Failure` of a
worker link does not. Pure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgpack

from nondum.sdk import errors
from nondum.sdk.codec.checks import Mismatch
from nondum.sdk.codec.values import from_plain, to_plain
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.wire import Body

_CLASSES: Mapping[str, type[NondumError]] = {
    name: found
    for name, found in vars(errors).items()
    if isinstance(found, type) and issubclass(found, NondumError)
}


@dataclass(frozen=True, slots=True)
class _Refusal:
    error: str
    problems: tuple[Problem, ...]


def asked(value: Any) -> Body:
    """The body of a request about a value. Raises `TypeError` for what is no plain data."""
    return {"about": _packed(value)}


def about(body: Body) -> Any:
    """What a request is about. Raises `ProtocolViolation`."""
    return _unpacked(body.get("about"))


def done(value: Any) -> Body:
    """The body of a reply with a result. Raises `TypeError` for what is no plain data."""
    return {"result": _packed(value)}


def refused(error: NondumError) -> Body:
    """The body of a reply that is a refusal; of a class that is known nowhere else, the nearest."""
    name = next(kind.__name__ for kind in type(error).__mro__ if kind.__name__ in _CLASSES)
    return {"refusal": _packed(to_plain(_Refusal(name, error.problems)))}


def outcome(body: Body) -> Any:
    """The result in a reply. Raises the `NondumError` in it, or `ProtocolViolation`.

    >>> outcome(done({"at": 7}))
    {'at': 7}
    """
    if "result" in body:
        return _unpacked(body["result"])
    try:
        refusal = from_plain(_Refusal, _unpacked(body.get("refusal")))
        error = _CLASSES[refusal.error](*refusal.problems)
    except (Mismatch, KeyError, ValueError) as wrong:
        raise _violation(f"no refusal: {wrong}") from wrong
    raise error


def _packed(value: Any) -> bytes:
    packed: bytes = msgpack.packb(value, unicode_errors="surrogatepass")
    return packed


def _unpacked(data: object) -> Any:
    try:
        return msgpack.unpackb(data, unicode_errors="surrogatepass", strict_map_key=True)
    except (ValueError, TypeError, msgpack.UnpackException) as error:
        raise _violation(f"no value: {error}") from error


def _violation(message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem("PACKET_FIELDS", message))
