"""A plugin, found by its entry point, registered with pluggy, and asked what it is.

Everything wrong with a description is reported at once.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import re
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from typing import Any

import pluggy

from nondum.sdk import hooks
from nondum.sdk.action_fragment import StatedAction, generated_fragments
from nondum.sdk.decorators import behaviour_of, condition_of, effect_of
from nondum.sdk.description import (
    WHEN_LOST,
    Behaviour,
    Condition,
    Fragment,
    PluginDescription,
    Unit,
)
from nondum.sdk.errors import NondumError, Problem, WorkerFailed
from nondum.sdk.frozen import frozen
from nondum.sdk.raised import within_packages
from nondum.sdk.signature import parse_signature
from nondum.sdk.ticked import TickedBehaviour

_NOT_THERE = (
    "correct the entry point in pyproject.toml; if it is right, install the package where this "
    "runs: `pip install -e .`"
)
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]*")


@frozen
class Plugin:
    """A loaded plugin; nothing of it has run but its import."""

    subject: object
    """The module or object that implements the hooks."""
    manager: pluggy.PluginManager
    distribution: str
    """Normalised name of the distribution: the plugin's name."""
    version: str

    @property
    def module(self) -> str:
        """The module that it is written in."""
        return _module_of(self.subject)

    @property
    def hook(self) -> pluggy.HookRelay:
        """The hooks, each answering with a list: empty when the plugin does not implement it."""
        return self.manager.hook

    def implements(self, hook: str) -> bool:
        """Whether the plugin has this hook."""
        return bool(getattr(self.hook, hook).get_hookimpls())

    def answer(self, hook: str, default: Any, **arguments: Any) -> Any:
        """Call a hook and give its answer, or `default` when there is none.

        Raises `WorkerFailed` (HOOK_FAILED) when the hook does.
        """
        try:
            answers = getattr(self.hook, hook)(**arguments)
        except Exception as error:
            raise WorkerFailed(_told("HOOK_FAILED", f"hook {hook!r} raised", error)) from error
        return answers[0] if answers else default


def load(target: str | object, distribution: str = "") -> Plugin:
    """Import and register a plugin.

    `target` is an entry point's value (`module` or `module:attribute`), or the module, class or
    object itself; a class is made without arguments. `distribution` defaults to the top-level
    package's name.

    Raises `WorkerFailed` (IMPORT_FAILED, HOOK_UNKNOWN).
    """
    subject = _import(target) if isinstance(target, str) else target
    if isinstance(subject, type):
        subject = _make(subject)
    name = distribution or _package_of(subject)
    manager = pluggy.PluginManager(hooks.PROJECT)
    manager.add_hookspecs(hooks)
    try:
        manager.register(subject, name)
        manager.check_pending()
    except pluggy.PluginValidationError as error:
        raise WorkerFailed(Problem("HOOK_UNKNOWN", str(error), where=name)) from error
    return Plugin(subject, manager, _normalised(name), version_of(name))


def describe(plugin: Plugin) -> PluginDescription:
    """Ask a plugin all that it says about itself.

    Fragments are the plugin's own, and one that is generated of the effects that its behaviours
    state.

    Raises `WorkerFailed` (HOOK_FAILED, DESCRIPTION_INVALID, ACTION_SIGNATURE, ACTION_EFFECT,
    BEHAVIOUR_PARAMETERS) with everything that is wrong.
    """
    behaviours = tuple(behaviours_of(plugin).values())
    fragments = _listed(plugin, "fragments")
    generated, mistaken = _generated(behaviours, fragments)
    described = PluginDescription(
        name=plugin.distribution,
        version=plugin.version,
        summary=_summary(plugin),
        behaviours=tuple(_marks(behaviours, behaviour_of)),
        conditions=tuple(_marks(conditions_of(plugin).values(), condition_of)),
        fragments=(*fragments, *generated),
        units=_listed(plugin, "units"),
        devices=_listed(plugin, "devices"),
        phrases=_listed(plugin, "phrases"),
        labels=_listed(plugin, "labels"),
    )
    problems = [
        *(problem for function in behaviours for problem in _parameter_problems(function)),
        *mistaken,
        *_unit_problems(described.units),
    ]
    if problems:
        raise WorkerFailed(*problems)
    # Round trip: a hook that gives values of wrong types is told so here, not by the host.
    return PluginDescription.parse(described.to_dict(), where=plugin.distribution)


def behaviours_of(plugin: Plugin) -> dict[str, Callable[..., Any]]:
    """The plugin's marked behaviours by name, in order of name. Raises `WorkerFailed`."""
    return _collected(plugin, "behaviours", behaviour_of)


def conditions_of(plugin: Plugin) -> dict[str, Callable[..., Any]]:
    """The plugin's marked conditions by name, in order of name. Raises `WorkerFailed`."""
    return _collected(plugin, "conditions", condition_of)


def _summary(plugin: Plugin) -> str:
    about = plugin.answer("describe", {})
    if not isinstance(about, Mapping) or not isinstance(about.get("summary", ""), str):
        raise _invalid("hook 'describe' gives no table of texts")
    docstring = (inspect.getdoc(plugin.subject) or "").partition("\n")[0]
    return str(about.get("summary", docstring))


def _listed(plugin: Plugin, hook: str) -> tuple[Any, ...]:
    answer = plugin.answer(hook, ())
    if not isinstance(answer, Sequence):
        raise _invalid(f"hook {hook!r} gives no list")
    return tuple(answer)


def _collected(
    plugin: Plugin, hook: str, mark_of: Callable[[object], Behaviour | Condition | None]
) -> dict[str, Callable[..., Any]]:
    found = _listed(plugin, hook) if plugin.implements(hook) else None
    members = list(_members(plugin.subject)) if found is None else list(found)
    marked = {id(member): (mark_of(member), member) for member in members}
    named: dict[str, Callable[..., Any]] = {}
    for mark, member in marked.values():
        if mark is None:
            if found is not None:
                raise _invalid(f"hook {hook!r} gave {member!r}, which carries no mark")
            continue
        if mark.name in named:
            raise _invalid(f"two {hook} are called {mark.name!r}")
        named[mark.name] = member
    return dict(sorted(named.items()))


def _members(subject: object) -> Iterator[Any]:
    """What a module or object has, without running any property."""
    for name, member in inspect.getmembers_static(subject):
        if not isinstance(member, property):
            yield getattr(subject, name)


def _marks(functions: Any, mark_of: Callable[[object], Any]) -> Iterator[Any]:
    return (mark_of(function) for function in functions)


def _generated(
    behaviours: Sequence[Callable[..., Any]], fragments: tuple[Any, ...]
) -> tuple[tuple[Fragment, ...], tuple[Problem, ...]]:
    """The fragment of the effects that are stated, and what is wrong with them. Signatures that
    cannot be read are told elsewhere."""
    stated: list[StatedAction] = []
    for function in behaviours:
        described, effect = behaviour_of(function), effect_of(function)
        if described and effect:
            with contextlib.suppress(WorkerFailed):
                signature = parse_signature(described.action)
                stated.append(StatedAction(signature, effect, _where(function, described)))
    written = (fragment for fragment in fragments if isinstance(fragment, Fragment))
    try:
        return generated_fragments(stated, written), ()
    except WorkerFailed as failed:
        return (), failed.problems


def _parameter_problems(function: Callable[..., Any]) -> Iterator[Problem]:
    described = behaviour_of(function)
    if described is None:
        return
    where = _where(function, described)
    if described.when_lost not in WHEN_LOST:
        need, have = " or ".join(map(repr, WHEN_LOST)), repr(described.when_lost)
        yield Problem(
            "DESCRIPTION_INVALID",
            "`when_lost` says what becomes of it without its caller",
            where=where,
            need=need,
            have=have,
        )
    try:
        action = parse_signature(described.action)
    except NondumError as error:
        yield from (Problem(p.code, p.message, where=where) for p in error.problems)
        return
    if described.name.lstrip().startswith("("):
        message = f"its action is {described.action!r}, and its name is a signature, too"
        fix = "give `@behaviour` one of them: a signature, or a name and `action`"
        yield Problem("ACTION_SIGNATURE", message, where=where, fix=fix)
    expected = ["ctx", *(parameter.identifier for parameter in action.parameters)]
    found = list(_parameters(function))
    if found != expected:
        yield Problem(
            "BEHAVIOUR_PARAMETERS",
            f"{getattr(function, '__qualname__', function)} takes ({', '.join(found)}), but its "
            f"action has ({', '.join(expected)})",
            where=where,
            fix="give the function `ctx` and then the action's parameters, by name and in order",
        )


def _where(function: Callable[..., Any], described: Behaviour) -> str:
    return f"{_place(function)} behaviour {described.name!r}".lstrip()


def _place(function: Callable[..., Any]) -> str:
    """File and line of the function's code; empty where it has no Python code."""
    if isinstance(function, type) and issubclass(function, TickedBehaviour):
        function = function.initialise
    code = getattr(function, "__code__", None)
    return f"{within_packages(code.co_filename)}:{code.co_firstlineno}" if code else ""


def _parameters(function: Callable[..., Any]) -> Iterator[str]:
    if isinstance(function, type) and issubclass(function, TickedBehaviour):
        yield from list(inspect.signature(function.initialise).parameters)[1:]
    else:
        yield from inspect.signature(function).parameters


def _unit_problems(units: tuple[Unit, ...]) -> Iterator[Problem]:
    if not all(isinstance(unit, Unit) for unit in units):
        yield Problem("DESCRIPTION_INVALID", "hook 'units' gave something that is no Unit")
        return
    slots = [slot.name for unit in units for slot in unit.outputs]
    for what, names in (("unit", [unit.name for unit in units]), ("output slot", slots)):
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield Problem("DESCRIPTION_INVALID", f"two of the {what}s are called {name!r}")
        for name in names:
            if not _NAME.fullmatch(name) or "__" in name:
                yield Problem(
                    "DESCRIPTION_INVALID",
                    f"{name!r} is no name of a {what}",
                    need="small letters, digits, - and single _",
                    have=repr(name),
                )


def _import(target: str) -> object:
    module, _, attribute = target.partition(":")
    try:
        found: object = importlib.import_module(module)
        for part in filter(None, attribute.split(".")):
            found = getattr(found, part)
    except Exception as error:
        problem = _told("IMPORT_FAILED", f"cannot import {target!r}", error)
        if isinstance(error, ModuleNotFoundError) and f"{module}.".startswith(f"{error.name}."):
            problem = replace(problem, where="", fix=_NOT_THERE)  # the line is Python's own
        raise WorkerFailed(problem) from error
    return found


def _make(plugin_class: type[Any]) -> object:
    try:
        return plugin_class()
    except Exception as error:
        what = f"cannot make {plugin_class.__qualname__}"
        raise WorkerFailed(_told("IMPORT_FAILED", what, error)) from error


def _told(code: str, what: str, error: BaseException) -> Problem:
    """An author's error as a problem that names its file and line."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f"{within_packages(frames[-1].filename)}:{frames[-1].lineno}" if frames else ""
    fix = ""
    if isinstance(error, ModuleNotFoundError) and error.name:
        fix = f"add the distribution that has {error.name!r} to `dependencies` in pyproject.toml"
    return Problem(code, f"{what}: {type(error).__name__}: {error}", where=place, fix=fix)


def _invalid(message: str) -> WorkerFailed:
    return WorkerFailed(Problem("DESCRIPTION_INVALID", message))


def _module_of(subject: object) -> str:
    return subject.__name__ if inspect.ismodule(subject) else type(subject).__module__


def _package_of(subject: object) -> str:
    return _module_of(subject).partition(".")[0]


def _normalised(name: str) -> str:
    """The name as PyPA normalises it."""
    return re.sub(r"[-_.]+", "-", name).lower().strip("-")


def version_of(distribution: str) -> str:
    """The installed version of a distribution; "0" when it runs from its source folder."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "0"
