"""What behaviours have in use: facts, `idle` and `free`, that do not hold while they run. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from nondum.host.mind.runner import RunningBehaviour
from nondum.host.peers.remote_calls import is_peers
from nondum.planning.merge.core import TAKEN_PREDICATES
from nondum.planning.merge.domain import Merged, bind
from nondum.planning.pddl.facts import predicate_of


def uses_of(running: Iterable[RunningBehaviour]) -> frozenset[str]:
    """The facts about this host's components that its running behaviours make false."""
    return frozenset(
        text
        for run in running
        if not is_peers(run.component)
        for text in run.step.delete
        if predicate_of(text) in TAKEN_PREDICATES
    )


def taken_by(
    merged: Merged, plugin: str, behaviour: str, arguments: Mapping[str, str]
) -> frozenset[str]:
    """The facts that a behaviour of a plugin takes, called with these objects; none where no
    action of the plugin is carried out by it."""
    bound = {f"?{name}": thing for name, thing in arguments.items()}
    return frozenset(
        bind(atom, bound)
        for action in merged.domain.actions.values()
        if action.plugin == plugin and action.behaviour == behaviour
        if set(action.parameter_names) == arguments.keys()
        for atom in action.effect.delete
        if atom.predicate in TAKEN_PREDICATES
    )
