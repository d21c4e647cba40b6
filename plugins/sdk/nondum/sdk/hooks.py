"""The hooks that a plugin may implement, by the names that pluggy knows them by.

*Describing* hooks say what a plugin is and can do. They are pure: same answer every time, nothing
opened, nothing started; a payload carries their answers in `index.json`, and a worker whose
answers differ is refused. *Acting* hooks do something. They may be coroutines (run on the worker's
loop) or plain functions (run in a thread).

A plugin is a module, or a class that is made without arguments, named by the entry point in group
`nondum.plugins`. It implements the hooks that it needs:

    from nondum.sdk import Fragment, Unit, hookimpl

    @hookimpl
    def units():
        return [Unit("head", "pointer")]

    @hookimpl
    def fragments():
        return [Fragment.from_package(__package__, "domain.pddl")]
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pluggy

from nondum.sdk.description import DeviceNeed, Fragment, Label, Phrase, Unit

if TYPE_CHECKING:
    from nondum.sdk.context import Context

PROJECT = "nondum"

hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def describe() -> Mapping[str, str]:  # type: ignore[empty-body]  # specifications have no body
    """Say what the plugin is: `{"summary": "One line."}`.

    Without it, the first line of the plugin's docstring is the summary.
    """


@hookspec
def behaviours() -> Sequence[Callable[..., Any]]:  # type: ignore[empty-body]  # a specification
    """Give the functions, methods and classes marked with `@behaviour`.

    Without it, all that the plugin's module or object has are found.
    """


@hookspec
def conditions() -> Sequence[Callable[..., Any]]:  # type: ignore[empty-body]  # a specification
    """Give the functions and methods marked with `@condition`.

    Without it, all that the plugin's module or object has are found.
    """


@hookspec
def fragments() -> Sequence[Fragment]:  # type: ignore[empty-body]  # a specification
    """Give the PDDL that the plugin contributes: actions, types, predicates, static facts."""


@hookspec
def units() -> Sequence[Unit]:  # type: ignore[empty-body]  # a specification
    """Give the units that the plugin acts with, their output slots and optional inputs."""


@hookspec
def devices() -> Sequence[DeviceNeed]:  # type: ignore[empty-body]  # a specification
    """Give the devices that the plugin opens. The payload's manifest must ask for the same."""


@hookspec
def phrases() -> Sequence[Phrase]:  # type: ignore[empty-body]  # a specification
    """Give patterns of words and the goals they ask for, beyond those of `@behaviour`."""


@hookspec
def labels() -> Sequence[Label]:  # type: ignore[empty-body]  # a specification
    """Give the words by which people call the objects and classes that the plugin brings."""


@hookspec
async def start(ctx: Context) -> None:
    """Get ready, once per worker, before the first behaviour.

    Open what stays open, `ctx.spawn` what runs all the time, send outputs that are always produced.
    Raising `NondumError` refuses the component with that problem.
    """


@hookspec
async def stop(ctx: Context) -> None:
    """Leave everything safe. All behaviours have ended; about two seconds remain."""


@hookspec
async def translate_goal(
    ctx: Context, words: str, vocabulary: Mapping[str, Any]
) -> Mapping[str, str] | None:
    """Translate words that match no phrase into some that do, `{"words": "follow the person"}`, or
    into a goal, `{"pddl": "(following self person)", "kind": "maintain"}` (without `kind`,
    `achieve`), or give None.

    `vocabulary` is what is known now: `host`; `sentences` that are understood; `phrases`, the same
    with slots, `{"words": "search for {class}", "slots": {"class": ["people"]}}`, where a slot
    without names takes any words; `objects`, each with `name`, `types` and `words`; `predicates` as
    PDDL declares them. The answer is parsed and type-checked like anyone's, and shown to the
    person, who confirms it. A host waits for it `planning.translate_s`.
    """


@hookspec
async def speak(ctx: Context, text: str) -> None:
    """Say `text` to the people around; return when it has been said."""


@hookspec
async def listen(ctx: Context) -> Mapping[str, str]:  # type: ignore[empty-body]  # a specification
    """Wait for a person to say something: `{"words": "follow me"}`."""


@hookspec
async def learn_words(ctx: Context, vocabulary: Mapping[str, Any]) -> None:
    """Learn what can be said now; for those that listen, before and while they do.

    `vocabulary` has `phrases`, patterns with `[optional]` parts and `{slots}`; `stops`, those of
    them that stop the robot, of which none should be missed; and `names`: slot → the words that may
    be said there, without articles. The slot `addressee` is for names of hosts, which have none. A
    slot without names takes any words. The host calls this again each time the vocabulary changes.
    """


DESCRIBING: tuple[str, ...] = (
    "describe",
    "behaviours",
    "conditions",
    "fragments",
    "units",
    "devices",
    "phrases",
    "labels",
)
ACTING: tuple[str, ...] = ("start", "stop", "translate_goal", "speak", "listen", "learn_words")
