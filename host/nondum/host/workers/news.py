"""What a worker's events mean, parsed: a stranger's words become the host's values here."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing
from nondum.host.core.events.workers import WorkerFaulted, WorkerLogged
from nondum.host.core.placed import placed
from nondum.host.core.printable import printable, printable_text
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import MessageInvalid, Problem, ProtocolViolation
from nondum.sdk.messages import value_from_wire
from nondum.sdk.wire import pack

MAX_WORD = 256
"""Characters in a predicate, an object or a log level."""

MAX_COUNT = 2**31
MAX_RATE_HZ = 1e6
"""Messages a second; no worker can send as many."""
MAX_TEXT = 16 * 1024
"""Characters of one message that are kept."""
MAX_REASON = 1000
"""Characters of the error that a condition ended with."""
MAX_CLAIMS = 4096
"""Facts that one worker may say at once."""
MAX_CLAIMED_BYTES = 4 * 1024 * 1024
"""Size of their values altogether, as they travel."""

MAX_SAID = 512
"""Characters of a part of what a worker says is wrong with it."""
NOTHING: Mapping[str, str] = {}

News: TypeAlias = FactKnown | FactForgotten | StreamFlowing | WorkerFaulted | WorkerLogged

_CODE = re.compile(r"[A-Z][A-Z0-9_-]{2,40}")


class Claims:
    """What a worker says is so now: its facts, and which of its streams flow."""

    def __init__(self) -> None:
        self._facts: dict[tuple[str, ...], FactKnown] = {}
        self._flows: dict[str, StreamFlowing] = {}
        self._bytes = 0

    def __iter__(self) -> Iterator[FactKnown | StreamFlowing]:
        """The news that still hold."""
        yield from tuple(self._facts.values())
        yield from tuple(self._flows.values())

    def take(self, news: News) -> None:
        """Take in one more. Raises `ProtocolViolation` (EVENT_INVALID) when there are too many."""
        match news:
            case FactKnown(_, predicate, arguments):
                self._forget(predicate, *arguments)
                self._facts[predicate, *arguments] = news
                self._bytes += _size(news)
            case FactForgotten(_, predicate, arguments):
                self._forget(predicate, *arguments)
            case StreamFlowing(_, stream, True):
                self._flows[stream] = news
            case StreamFlowing(_, stream, False):
                self._flows.pop(stream, None)
        if len(self._facts) + len(self._flows) > MAX_CLAIMS:
            raise _violation("EVENT_INVALID", f"a worker says more than {MAX_CLAIMS} facts")
        if self._bytes > MAX_CLAIMED_BYTES:
            told = f"the values of a worker's facts take more than {MAX_CLAIMED_BYTES} bytes"
            raise _violation("EVENT_INVALID", told)

    def _forget(self, *fact: str) -> None:
        known = self._facts.pop(fact, None)
        if known is not None:
            self._bytes -= _size(known)


def _size(news: FactKnown) -> int:
    return sum(map(len, news.arguments)) + (len(pack(news.value)) if news.value else 0)


def parse_rates(outputs: Collection[str], body: Mapping[str, Any]) -> dict[str, float]:
    """Messages a second of each of a worker's own streams, as its heartbeat tells.

    What cannot be so is left out: people are shown it, and nothing goes by it.
    """
    told = body.get("rates")
    return {
        stream: float(rate_hz)
        for stream, rate_hz in (told.items() if isinstance(told, Mapping) else ())
        if stream in outputs and type(rate_hz) in (int, float) and 0 <= rate_hz <= MAX_RATE_HZ
    }


def parse_news(
    component: str,
    outputs: Collection[str],
    name: str,
    body: Mapping[str, Any],
    value_types: Mapping[str, str] = NOTHING,
) -> News:
    """Make the host's event of a worker's, whose own streams are `outputs`; `value_types` has the
    declared type of message of valued predicates.

    Raises `ProtocolViolation` (EVENT_UNKNOWN, EVENT_INVALID, RESULT_INVALID), and
    `MessageInvalid` for a wrong value of a fact, which is no reason to end the worker.
    """
    match name, body:
        case "know", {"predicate": str(predicate), "arguments": list(arguments), **rest}:
            objects = tuple(_word(argument) for argument in arguments)
            value = _value(_word(predicate), rest, value_types)
            return FactKnown(component, predicate, objects, value)
        case "fault", {"problem": dict(problem)}:
            return WorkerFaulted(component, (_fault(component, problem),))
        case "forget", {"predicate": str(predicate), "arguments": list(arguments)}:
            objects = tuple(_word(argument) for argument in arguments)
            return FactForgotten(component, _word(predicate), objects)
        case "flow", {"stream": str(stream), "flowing": bool(flowing)}:
            if stream not in outputs:
                raise _violation("RESULT_INVALID", f"{stream!r:.80} is no stream of this component")
            return StreamFlowing(component, stream, flowing)
        case "log", {"level": str(level), "message": str(message)}:
            return WorkerLogged(component, _word(level), printable_text(message[:MAX_TEXT]))
        case (("know" | "forget" | "flow" | "fault" | "log"), _):
            raise _violation("EVENT_INVALID", f"event {name!r} lacks what it tells")
    raise _violation("EVENT_UNKNOWN", f"no event of a worker is called {name!r}")


def parse_progress(body: Mapping[str, Any]) -> tuple[float, str]:
    """How far a behaviour is, 0..1, and in words. Raises `ProtocolViolation`."""
    match body:
        case {"fraction": (float() | int()) as fraction, "text": str(text)}:
            return min(max(float(fraction), 0.0), 1.0), printable(text)
    raise _violation("EVENT_INVALID", "event 'progress' lacks what it tells")


def parse_answer(body: Mapping[str, Any]) -> str:
    """What a behaviour that succeeded answers, or nothing. Raises `ProtocolViolation`."""
    answer = body.get("answer", "")
    if not isinstance(answer, str):
        raise _violation("RESULT_INVALID", "the answer of a behaviour is no text")
    return printable(answer[:MAX_TEXT])


def parse_count(body: Mapping[str, Any]) -> int:
    """How often something was so. Raises `ProtocolViolation`."""
    match body:
        case {"count": int(count)} if 0 < count <= MAX_COUNT and count is not True:
            return count
    raise _violation("EVENT_INVALID", "event 'crowded' lacks what it tells")


def parse_condition(said: PluginDescription, body: Mapping[str, Any]) -> tuple[str, Problem]:
    """Which condition of a plugin has ended, and with what error. Raises `ProtocolViolation`."""
    match body:
        case {"condition": str(name), "problem": {"message": str(message), **rest}}:
            if all(condition.name != name for condition in said.conditions):
                raise _violation("EVENT_INVALID", f"{name!r:.80} is no condition of the plugin")
            where = rest.get("where", "")
            place = printable(where[:MAX_WORD]) if isinstance(where, str) else ""
            return name, Problem("CONDITION_RAISED", printable(message[:MAX_REASON]), place)
    raise _violation("EVENT_INVALID", "event 'condition-ended' lacks what it tells")


def _word(value: object) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= MAX_WORD or not value.isprintable():
        raise _violation("EVENT_INVALID", f"expected a name, found {value!r:.80}")
    return value


def _value(predicate: str, rest: Mapping[str, Any], value_types: Mapping[str, str]) -> Any:
    if "value" not in rest:
        return None
    try:
        value = value_from_wire(rest["value"])
    except MessageInvalid as error:
        raise MessageInvalid(*(_of_fact(predicate, p) for p in error.problems)) from error
    declared = value_types.get(predicate, value.TYPE)
    if declared != value.TYPE:
        told = "it is of another type than its fragment declares"
        problem = Problem("MESSAGE_TYPE", told, need=declared, have=value.TYPE)
        raise MessageInvalid(_of_fact(predicate, problem))
    return rest["value"]


def _of_fact(predicate: str, problem: Problem) -> Problem:
    field = f"{problem.where}: " if problem.where else ""
    return replace(
        problem, message=f"the value of {predicate} is left out: {field}{problem.message}"
    )


def _fault(component: str, said: Mapping[str, Any]) -> Problem:
    """A worker's own words on what is wrong with it, bounded, under its name."""
    code, message, where = (
        str(said.get(key, ""))[:MAX_SAID] for key in ("code", "message", "where")
    )
    need, have = (str(said.get(key) or "")[:MAX_SAID] for key in ("need", "have"))
    if not _CODE.fullmatch(code):
        raise _violation("EVENT_INVALID", "event 'fault' names no code")
    place = placed(component, printable(where))
    return Problem(
        code, printable(message), where=place, need=printable(need), have=printable(have)
    )


def _violation(code: str, message: str) -> ProtocolViolation:
    return ProtocolViolation(Problem(code, message))
