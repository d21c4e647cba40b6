"""How each kind of behaviour and hook is run: coroutine, plain function, ticked class."""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable
from typing import Any

from pluggy import HookImpl

from nondum.sdk.context import Context
from nondum.sdk.errors import BehaviourFailed, NondumError
from nondum.sdk.raised import raised
from nondum.sdk.threads import run_in_thread
from nondum.sdk.ticked import Status, TickedBehaviour


async def call(function: Callable[..., Any], context: Context, *arguments: Any, **more: Any) -> Any:
    """Call a coroutine function on the loop, a plain one in a thread; the context comes first."""
    if inspect.iscoroutinefunction(function):
        return await function(context, *arguments, **more)
    return await run_in_thread(function, context, *arguments, **more)


async def call_hook(implementation: HookImpl, context: Context, **arguments: Any) -> Any:
    """Call an acting hook with as many of the arguments as it takes (as pluggy does)."""
    function = implementation.function
    wanted = {name: arguments[name] for name in arguments if name in implementation.argnames}

    def with_context(given: object) -> dict[str, Any]:
        return {"ctx": given, **wanted} if "ctx" in implementation.argnames else wanted

    if inspect.iscoroutinefunction(function):
        return await function(**with_context(context))
    return await run_in_thread(lambda given: function(**with_context(given)), context)


class Runner:
    """Runs a plugin's behaviours; keeps the object of each ticked one."""

    def __init__(self) -> None:
        self._ticked: dict[type[TickedBehaviour], TickedBehaviour] = {}

    async def run(self, marked: Callable[..., Any], context: Context, *arguments: str) -> str:
        """Run a behaviour to its end, and give what it answers, if it does.

        Raises `BehaviourFailed` for whatever it raises itself.
        """
        try:
            if isinstance(marked, type) and issubclass(marked, TickedBehaviour):
                await self._run_ticked(marked, context, *arguments)
                return ""
            answer = await call(marked, context, *arguments)
        except NondumError:
            raise
        except Exception as error:
            context.log.exception("a behaviour raised")
            raise BehaviourFailed(raised("BEHAVIOUR_RAISED", error, marked)) from error
        return answer if isinstance(answer, str) else ""

    async def _run_ticked(
        self, kind: type[TickedBehaviour], context: Context, *arguments: str
    ) -> None:
        behaviour = self._ticked.get(kind)
        if behaviour is None:
            behaviour = self._ticked[kind] = kind()
            behaviour.setup(context)
        behaviour.is_established, was_established = False, False
        behaviour.feedback_message = ""
        status = Status.INVALID
        behaviour.initialise(context, *arguments)
        try:
            while (status := behaviour.update()) is Status.RUNNING:
                if behaviour.is_established and not was_established:
                    was_established = True
                    await context.established()
                await asyncio.sleep(1 / kind.rate_hz)
        except asyncio.CancelledError:
            status = Status.INVALID
            raise
        finally:
            behaviour.terminate(status)
        if status is not Status.SUCCESS:
            raise BehaviourFailed(behaviour.feedback_message or "the last tick came to FAILURE")
