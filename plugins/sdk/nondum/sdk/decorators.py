"""The marks by which a plugin's behaviours and conditions are found: `@behaviour`, `@condition`.

They return what they mark unchanged, so that it can still be called and tested directly. Nothing is
checked here; `nondum.sdk.plugin.describe` checks everything and reports it at once.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from nondum.sdk.action_fragment import StatedEffect, with_host
from nondum.sdk.description import Behaviour, Condition

_Marked = TypeVar("_Marked", bound=Callable[..., Any])

BEHAVIOUR_MARK = "__nondum_behaviour__"
EFFECT_MARK = "__nondum_effect__"
CONDITION_MARK = "__nondum_condition__"

_SIGNATURE = re.compile(r"\s*\(\s*([^\s()]*)")


def behaviour(
    name: str,
    *,
    action: str | None = None,
    makes: str | None = None,
    needs: str = "",
    lasting: bool = False,
    phrase: str | Sequence[str] | None = None,
    when_lost: str = "stop",
) -> Callable[[_Marked], _Marked]:
    """Mark a function, method or `TickedBehaviour` subclass as a behaviour.

    It carries out the action whose signature is `action`: `(point ?u - pointer ?h - host)`. Its
    parameters are `ctx` and then the action's, by name and in order; it gets the objects' names.
    A coroutine function runs on the worker's loop, a plain function in its own thread.

    `name` may be the signature itself; then the behaviour has the action's name.

    A fragment of the plugin declares the action; or `makes` states its effect in PDDL, `(lit ?h)`,
    and the fragment is generated. Its precondition is `(ready ?u)`, `(on ?u ?h)` where a host is
    among the parameters, and what `needs` adds. Where the effect or `needs` speaks of ?h, and the
    signature does not, `?h - host` is its last parameter. What no fragment declares is declared:
    predicates, and the type of ?u as a kind of unit.

    Returning is SUCCESS, raising `BehaviourFailed` is FAILURE, and so is any other error; being
    cancelled is being halted. A text that is returned is the answer to the person who gave the
    goal: the host shows it and speaks it. A lasting behaviour never ends by itself and says
    `await ctx.established()` when its effects begin to hold.

    `phrase` is one pattern, or several, of words that ask for it: `"point at {t}"`.

    `when_lost` says what becomes of it when another host asked for it and is lost: `stop`, `hold`
    what it does, or `finish` it (see `nondum.sdk.description.WHEN_LOST`).
    """
    found = _SIGNATURE.match(name) if action is None else None
    signature, called = (name, found[1]) if found else (action or "", name)
    effect = StatedEffect(makes or "", needs) if needs or makes is not None else None
    signature = with_host(signature, effect) if effect else signature
    phrases = (phrase,) if isinstance(phrase, str) else tuple(phrase or ())
    return partial(_mark, Behaviour(called, signature, lasting, phrases, "", when_lost), effect)


def _mark(behaviour: Behaviour, effect: StatedEffect | None, marked: _Marked) -> _Marked:
    setattr(marked, BEHAVIOUR_MARK, replace(behaviour, doc=_first_line(marked)))
    setattr(marked, EFFECT_MARK, effect)
    return marked


def condition(name: str, *, predicates: Sequence[str]) -> Callable[[_Marked], _Marked]:
    """Mark a function or method, with the one parameter `ctx`, as a condition.

    It runs from the worker's start to its stop and keeps facts of the named predicates true or
    false with `ctx.know` and `ctx.forget`. When it ends, what it said is forgotten.
    """

    def mark(marked: _Marked) -> _Marked:
        setattr(marked, CONDITION_MARK, Condition(name, tuple(predicates), _first_line(marked)))
        return marked

    return mark


def behaviour_of(marked: object) -> Behaviour | None:
    """The behaviour that a function, method or class is marked with."""
    found = getattr(marked, BEHAVIOUR_MARK, None)
    return found if isinstance(found, Behaviour) else None


def effect_of(marked: object) -> StatedEffect | None:
    """The effect that `@behaviour` states of a function's action."""
    found = getattr(marked, EFFECT_MARK, None)
    return found if isinstance(found, StatedEffect) else None


def condition_of(marked: object) -> Condition | None:
    """The condition that a function or method is marked with."""
    found = getattr(marked, CONDITION_MARK, None)
    return found if isinstance(found, Condition) else None


def _first_line(marked: object) -> str:
    return (inspect.getdoc(marked) or "").partition("\n")[0]
