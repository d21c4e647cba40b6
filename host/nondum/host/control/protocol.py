"""The words of the control socket: one JSON object a line, in either direction.

A request is `{"verb": …, "arguments": {…}}`; each answer line is `{"result": …}` or
`{"problems": [{code, message, …}]}`. A verb that follows (`watch`) sends result lines until the
asking side closes, or sends its next line, which is answered then.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.sdk.frozen import frozen

LINE_LIMIT = 8 * 1024 * 1024
"""Bytes in one line; a catalogue of hundreds of components stays far below."""


@frozen
class Request:
    """What one client asks."""

    verb: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


def encode_request(request: Request) -> bytes:
    """One line that asks."""
    return _line({"verb": request.verb, "arguments": dict(request.arguments)})


def decode_request(line: bytes) -> Request:
    """Parse a line that asks. Raises `ProtocolViolation` (CONTROL_REQUEST)."""
    try:
        data = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise _violation(f"not a line of JSON ({error})") from error
    if not isinstance(data, dict) or not isinstance(data.get("verb"), str):
        raise _violation('expected {"verb": …, "arguments": {…}}')
    arguments = data.get("arguments", {})
    if not isinstance(arguments, dict):
        raise _violation("arguments must be an object")
    return Request(data["verb"], arguments)


def encode_result(result: Any) -> bytes:
    """One line that answers."""
    return _line({"result": result})


def encode_problems(problems: Sequence[Problem]) -> bytes:
    """One line that refuses."""
    return _line({"problems": [problem.to_dict() for problem in problems]})


def decode_answer(line: bytes) -> tuple[Any, tuple[Problem, ...]]:
    """The result of an answer line, and its problems: one of them is empty.

    Raises `ProtocolViolation` (CONTROL_ANSWER) for anything else.

    >>> decode_answer(b'{"result":{"halted":[]}}')
    ({'halted': []}, ())
    """
    try:
        data = json.loads(line)
        problems = tuple(Problem(**problem) for problem in data.get("problems", ()))
    except (ValueError, RecursionError, TypeError, AttributeError) as error:
        text = f"the answer is not one of a nondum daemon ({error})"
        fix = "is command and daemon of one version?"
        problem = Problem("CONTROL_ANSWER", text, where="control socket", fix=fix)
        raise ProtocolViolation(problem) from error
    return data.get("result"), problems


def _line(data: Mapping[str, Any]) -> bytes:
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace") + b"\n"  # half a letter is an escape in JSON


def _violation(message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem("CONTROL_REQUEST", message, where="control socket"))
