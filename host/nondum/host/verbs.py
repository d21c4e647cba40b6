"""The verbs of the control socket: questions and orders by name."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from typing import Any

from nondum.host.control.arguments import Arguments
from nondum.host.control.server import Follow, Verb
from nondum.host.orders import Orders
from nondum.host.questions import Questions
from nondum.host.rows import Row


def answering(questions: Questions, orders: Orders) -> dict[str, Verb]:
    """Verbs that answer once."""
    verbs: dict[str, Callable[[Arguments], Awaitable[Any]]] = {
        "behaviours": questions.behaviours,
        "components": questions.components,
        "composition": questions.composition,
        "devices": questions.devices,
        "fact": questions.fact,
        "facts": questions.facts,
        "forget": orders.forget,
        "goal": orders.goal,
        "goals": questions.goals,
        "halt": orders.halt,
        "journal": questions.journal,
        "logs": questions.logs,
        "mount": orders.mount,
        "plan": questions.plan,
        "retry": orders.retry,
        "status": questions.status,
        "store": questions.store,
        "streams": questions.streams,
        "tap": orders.tap,
        "tree": questions.tree,
        "uninstall": orders.uninstall,
        "units": questions.units,
        "why": questions.why,
    }
    return {name: _parsing(verb) for name, verb in verbs.items()}


def following(questions: Questions, orders: Orders) -> dict[str, Follow]:
    """Verbs that go on answering."""
    verbs: dict[str, Callable[[Arguments], AsyncIterator[Row]]] = {
        "follow_goal": questions.follow_goal,
        "follow_tree": questions.follow_tree,
        "install": orders.install,
        "watch": questions.watch,
    }
    return {name: _parsing(verb) for name, verb in verbs.items()}


def _parsing(verb: Callable[[Arguments], Any]) -> Callable[[Mapping[str, Any]], Any]:
    """The verb, given its arguments as they travel."""
    return lambda given: verb(Arguments(given))
