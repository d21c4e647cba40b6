"""Carries out what a host asks of a plugin: describe, start, behave, hooks, stop."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from nondum.sdk.context import Context
from nondum.sdk.decorators import behaviour_of, condition_of
from nondum.sdk.errors import NondumError, Problem, WorkerFailed
from nondum.sdk.plugin import Plugin, behaviours_of, conditions_of, describe
from nondum.sdk.raised import raised
from nondum.sdk.running import Runner, call, call_hook
from nondum.sdk.signature import parse_signature
from nondum.sdk.workplace import Workplace


class Performer:
    """A plugin at work in its place."""

    def __init__(self, plugin: Plugin, workplace: Workplace, log: logging.Logger) -> None:
        """Describe the plugin. Raises `WorkerFailed` with all that is wrong with it."""
        self.description = describe(plugin)
        workplace.declare(self.description)
        self._plugin, self._workplace, self._log = plugin, workplace, log
        self._behaviours = behaviours_of(plugin)
        self._runner = Runner()
        self._behaving: set[asyncio.Task[Any]] = set()
        self._conditions: list[asyncio.Task[None]] = []
        self._life = Context(workplace, log)

    async def start(self) -> None:
        """Run the start hook, then begin to watch the conditions."""
        await self.hook("start")
        for watch in conditions_of(self._plugin).values():
            self._conditions.append(asyncio.create_task(self._watch(watch)))

    async def stop(self) -> None:
        """Halt all, then run the stop hook. Stopping twice is allowed."""
        running = {*self._behaving, *self._conditions} - {asyncio.current_task()}
        for task in running:
            task.cancel()
        await asyncio.gather(*running, return_exceptions=True)
        life, self._life = self._life, Context(self._workplace, self._log)
        self._conditions.clear()
        await life.close()
        if self._plugin.implements("stop"):
            await self.hook("stop")

    async def behave(
        self, name: str, arguments: Mapping[str, str], values: Sequence[Any], call_id: int
    ) -> str:
        """Run a behaviour to its end, and give what it answers, if it does.

        Raises `BehaviourFailed`; `WorkerFailed` (BEHAVIOUR_UNKNOWN, ARGUMENTS).
        """
        marked, ordered = self._bound(name, arguments)
        self._workplace.update_values(list(values), [])
        context = Context(
            self._workplace, self._log, unit=ordered[0], arguments=arguments, call_id=call_id
        )
        task = asyncio.current_task()
        assert task is not None
        self._behaving.add(task)
        try:
            return await self._runner.run(marked, context, *ordered)
        finally:
            self._behaving.discard(task)
            await context.close()

    async def hook(self, name: str, **arguments: Any) -> Any:
        """Run an acting hook; None when the plugin has none.

        Raises `WorkerFailed` (HOOK_FAILED) when it raises anything but a `NondumError`.
        """
        if not self._plugin.implements(name):
            return None
        implementation = getattr(self._plugin.hook, name).get_hookimpls()[0]
        try:
            return await call_hook(implementation, self._life, **arguments)
        except NondumError:
            raise
        except Exception as error:
            self._log.exception("hook %s raised", name)
            problem = raised("HOOK_FAILED", error, implementation.function)
            told = replace(problem, message=f"hook {name!r} raised {problem.message}")
            raise WorkerFailed(told) from error

    def _bound(
        self, name: str, arguments: Mapping[str, str]
    ) -> tuple[Callable[..., Any], list[str]]:
        """The marked function, and the objects in the order of its parameters."""
        marked = self._behaviours.get(name)
        described = behaviour_of(marked)
        if marked is None or described is None:
            raise WorkerFailed(Problem("BEHAVIOUR_UNKNOWN", f"no behaviour is called {name!r}"))
        expected = [parameter.name for parameter in parse_signature(described.action).parameters]
        if set(expected) != set(arguments):
            raise WorkerFailed(
                Problem(
                    "ARGUMENTS",
                    f"behaviour {name!r} got other parameters than its action has",
                    need=", ".join(expected),
                    have=", ".join(arguments) or "none",
                )
            )
        return marked, [arguments[parameter] for parameter in expected]

    async def _watch(self, marked: Callable[..., Any]) -> None:
        described = condition_of(marked)
        assert described is not None
        context = Context(self._workplace, self._log, predicates=frozenset(described.predicates))
        try:
            await call(marked, context)
        except Exception as error:
            self._log.exception("condition %s ended with an error", described.name)
            problem = raised("CONDITION_RAISED", error, marked)
            body = {"condition": described.name, "problem": problem.to_dict()}
            self._workplace.tell("condition-ended", body, None)
        finally:
            await context.close(forget=True)
