"""Which behaviour carries an action out: both must say the same of its parameters."""

from __future__ import annotations

from collections.abc import Mapping

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.scope import Report
from nondum.planning.pddl.caret import nearest
from nondum.planning.pddl.parse import parse_signature
from nondum.planning.pddl.syntax import ActionDeclaration, TypedName
from nondum.planning.pddl.typegraph import types_or_root
from nondum.sdk.description import Behaviour
from nondum.sdk.errors import FragmentRefused, Problem


def behaviours_of(
    contribution: Contribution, actions: Mapping[str, ActionDeclaration], report: Report
) -> dict[str, Behaviour]:
    """Action → the behaviour that carries it out; none where behaviours are not known.

    Adds PDDL_BEHAVIOUR for a behaviour without its action, an action without a behaviour, two
    behaviours for one action, and parameters that differ.
    """
    if contribution.behaviours is None:
        return {}
    found: dict[str, Behaviour] = {}
    for behaviour in contribution.behaviours:
        name = _action_name(behaviour, actions, report)
        if name in found:
            message = f"behaviours {found[name].name!r} and {behaviour.name!r} carry out {name!r}"
            _refuse(behaviour, message, report)
        elif name:
            found[name] = behaviour
    for action in actions.values():
        if action.name not in found:
            message = f"no behaviour carries out action {action.name!r}"
            report.problem(
                "PDDL_BEHAVIOUR", message, action.place, "decorate the function that does"
            )
    return found


def _action_name(
    behaviour: Behaviour, actions: Mapping[str, ActionDeclaration], report: Report
) -> str:
    try:
        signature = parse_signature(behaviour.action, f"behaviour {behaviour.name}")
    except FragmentRefused as refused:
        report.problems.extend(report.signed(problem) for problem in refused.problems)
        return ""
    action = actions.get(signature.name)
    if action is None:
        message = f"no fragment declares its action {signature.name!r}"
        _refuse(behaviour, message, report, nearest(signature.name, actions))
        return ""
    if _plain(signature.parameters) != _plain(action.parameters):
        declared = " ".join(map(str, action.parameters))
        message = f"its action is {behaviour.action}, {action.place} has ({declared})"
        _refuse(behaviour, message, report, "use the same names and types, in the same order")
    return signature.name


def _plain(parameters: tuple[TypedName, ...]) -> list[tuple[str, tuple[str, ...]]]:
    return [(p.name, tuple(sorted(types_or_root(p.types)))) for p in parameters]


def _refuse(behaviour: Behaviour, message: str, report: Report, fix: str = "") -> None:
    where = f"{report.by} behaviour {behaviour.name!r}"
    report.problems.append(Problem("PDDL_BEHAVIOUR", message, where=where, fix=fix))
