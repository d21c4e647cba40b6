"""What a worker reports of itself and the world: told as events, and kept while it holds."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from nondum.host.core.events.behaviours import BehaviourProgressed
from nondum.host.core.events.event import Emit
from nondum.host.core.events.workers import ConditionEnded, WorkerFaulted, WorkerLogged
from nondum.host.core.placed import placed
from nondum.host.workers import problems
from nondum.host.workers.call import Call
from nondum.host.workers.faults import Faults
from nondum.host.workers.news import (
    Claims,
    parse_condition,
    parse_news,
    parse_progress,
    parse_rates,
)
from nondum.host.workers.output import Valve
from nondum.host.workers.spec import WorkerSpec
from nondum.planning.merge.core import core_value_types
from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.valued import value_types

LINE_COST = 64
"""Bytes that each logged line counts for beside its own."""


class Reports:
    """Of one worker. What is not as agreed raises `ProtocolViolation`, in all methods that take
    something in."""

    def __init__(self, spec: WorkerSpec, emit: Emit) -> None:
        self._spec, self._emit = spec, emit
        self.claims = Claims()
        """What it says is so."""
        self.faults = Faults()
        """Mistakes of its plugin that did not end it."""
        self.rates: dict[str, float] = {}
        """Messages a second of each of its streams, as its last heartbeat says."""
        self.dead_conditions: dict[str, Problem] = {}
        """Condition → the error that it ended with."""
        self._value_types = {**core_value_types(), **value_types(spec.index.fragments)}
        self._streams: frozenset[str] = frozenset()
        self._valve = Valve(asyncio.get_running_loop().time)

    def expect(self, streams: Iterable[str]) -> None:
        """The streams that it may tell of."""
        self._streams = frozenset(streams)

    def take_rates(self, body: Mapping[str, Any]) -> None:
        """Take in a heartbeat's rates."""
        self.rates = parse_rates(self._streams, body)

    def take_progress(self, body: Mapping[str, Any], call: Call | None) -> None:
        """Take in how far a behaviour is; None: it has just ended."""
        progress = parse_progress(body)
        if call is not None:
            self._emit(BehaviourProgressed(call.component, call.behaviour, call.id, *progress))

    def take_news(self, name: str, body: dict[str, Any]) -> None:
        """Take in a fact, a stream that flows or ends, a mistake, or a line that is logged."""
        component = self._spec.component
        try:
            news = parse_news(component, self._streams, name, body, self._value_types)
        except MessageInvalid as error:  # one wrong value is left out, and the worker goes on
            found = tuple(problems.located(component, error))
            news = WorkerFaulted(component, found)
            self._on_log(WorkerLogged(component, "error", problems.words(error)))
        match news:
            case WorkerLogged():
                self._on_log(news)
            case WorkerFaulted():
                if self.faults.take(news):
                    self._emit(news)
            case _:
                self.claims.take(news)
                self._emit(news)

    def take_condition(self, body: Mapping[str, Any]) -> None:
        """A condition will tell nothing any more; `tell_conditions` tells it again."""
        condition, problem = parse_condition(self._spec.index, body)
        component = self._spec.component
        if problem.where:
            self.faults.end(condition, placed(component, problem.where))
        where = placed(f"{condition} of {component}", problem.where)
        self.dead_conditions[condition] = replace(problem, where=where)
        self.tell_conditions()

    def tell_conditions(self) -> None:
        """Tell of the conditions that have ended, also to those who were not there at the time."""
        for condition, problem in self.dead_conditions.items():
            self._emit(
                ConditionEnded(self._spec.component, condition, (problem,), self._spec.payload)
            )

    def _on_log(self, line: WorkerLogged) -> None:
        if self._valve.passes(len(line.message) + LINE_COST):
            if told := self._valve.told():
                self._emit(WorkerLogged(self._spec.component, "log", told))
            self._emit(line)
