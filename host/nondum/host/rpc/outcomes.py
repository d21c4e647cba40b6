"""What a request is about and what comes of it, as the body of a message of a worker link. Pure.

Both are plain data that is packed for itself: the limits of a link's packets are for strangers, and
names of files need be no UTF-8. A refusal carries the class of its error, which a `Failure` of a
worker link does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgpack

from nondum.sdk import errors
from nondum.sdk.codec.values import reader, to_plain
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation
from nondum.sdk.wire import Body

_CLASSES: Mapping[str, type[NondumError]] = {
    name: found
    for name, found in vars(errors).items()
    if isinstance(found, type) and issubclass(found, NondumError)
}
_problems = reader(tuple[Problem, ...])


def packed(value: Any) -> Body:
    """The body of a request about a value, or of a reply with it as the result.

    Raises `TypeError` for what is no plain data.
    """
    return {"value": msgpack.packb(value, unicode_errors="surrogatepass")}


def refused(error: NondumError) -> Body:
    """The body of a reply that is a refusal; of a class that is known nowhere else, the nearest."""
    name = next(kind.__name__ for kind in type(error).__mro__ if kind.__name__ in _CLASSES)
    return {"error": name, **packed(to_plain(error.problems))}


def unpacked(body: Body) -> Any:
    """The value in a body. Raises the `NondumError` of a refusal, or `ProtocolViolation`.

    >>> unpacked(packed({"at": 7}))
    {'at': 7}
    """
    try:
        value = msgpack.unpackb(body["value"], unicode_errors="surrogatepass", strict_map_key=True)
        if "error" not in body:
            return value
        error = _CLASSES[body["error"]](*_problems(value))
    except (KeyError, TypeError, ValueError, msgpack.UnpackException) as wrong:
        text = f"no value and no refusal: {type(wrong).__name__}: {wrong}"
        raise ProtocolViolation(Problem("PACKET_FIELDS", text)) from wrong
    raise error
