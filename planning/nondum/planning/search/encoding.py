"""A ground task as integers: states are bit masks, and only what can change is in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeAlias

from nondum.planning.search.derivation import MaskLayer, Stage, stages_of
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import GroundAction, GroundTask

State: TypeAlias = int
"""A settled state: the bits of the facts that hold, derived ones included. Bit 0 always holds."""


@frozen
class When:
    """A conditional effect; its condition leaves out what the action requires anyway."""

    condition: int
    add: int
    delete: int


@frozen
class Move:
    """An action as masks."""

    action: int
    """Index into `GroundTask.actions`."""
    precondition: int
    add: int
    delete: int
    """Without what it also adds."""
    clear: int
    """What does not survive it: all that it deletes, and all that is derived."""
    cost: int
    conditional: tuple[When, ...]


@frozen
class Encoded:
    """What the searches work on."""

    width: int
    """Number of bits of a state."""
    init: State
    goal: int
    moves: tuple[Move, ...]
    layers: tuple[MaskLayer, ...]
    stages: tuple[Stage, ...]
    """What settles the layers."""

    def is_goal(self, state: State) -> bool:
        """Whether the goal holds."""
        return state & self.goal == self.goal

    def after(self, state: State, move: Move) -> State:
        """The state that a move leads to, where its precondition holds."""
        clear, add = move.clear, move.add
        for when in move.conditional:
            if when.condition & state == when.condition:
                clear |= when.delete
                add |= when.add
        reached = (state | clear) ^ clear | add
        for stage in self.stages:
            reached = stage.settled(reached)
        return reached


def encode(task: GroundTask, reached: frozenset[int]) -> Encoded:
    """Leave out facts that are true for ever, facts that nothing asks for, and actions that cannot
    be reached, change nothing, or do the same as a cheaper one.

    `reached` are its `reachable_facts`; the goal must be among them.
    """
    return _Encoder(task, reached).encoded()


class _Encoder:
    def __init__(self, task: GroundTask, reached: frozenset[int]) -> None:
        self._task = task
        self._reached = reached
        self._actions = [(i, a) for i, a in enumerate(task.actions) if a.precondition <= reached]
        self._rules = [[r for r in layer.rules if r.body <= reached] for layer in task.derived]
        pairs = [pair for layer in task.derived for pair in layer.complements]
        derived = {rule.head for rules in self._rules for rule in rules}.union(*pairs)
        deleted = {f for _, a in self._actions for f in _deleted(a)}
        asked = task.goal.union(
            (fact for fact, _ in pairs), *(rule.body for rules in self._rules for rule in rules)
        ).union(*map(_asked, (a for _, a in self._actions)))
        fluent = (asked & reached) - (task.init - deleted - derived)
        ordered = sorted(fluent, key=task.facts.__getitem__)
        self._bit = {fact: 1 << bit for bit, fact in enumerate(ordered, 1)}
        self._derived = self._mask(derived)

    def encoded(self) -> Encoded:
        layers = tuple(self._layers())
        stages = stages_of(layers)
        init = self._mask(self._task.init) | 1
        for stage in stages:
            init = stage.settled(init)
        return Encoded(
            width=len(self._bit) + 1,
            init=init,
            goal=self._mask(self._task.goal),
            moves=self._moves(),
            layers=layers,
            stages=stages,
        )

    def _mask(self, facts: Iterable[int]) -> int:
        bits = self._bit
        total = 0
        for fact in facts:
            total |= bits.get(fact, 0)
        return total

    def _layers(self) -> Iterator[MaskLayer]:
        for layer, rules in zip(self._task.derived, self._rules, strict=True):
            yield MaskLayer(
                tuple(
                    (self._bit[r.head], self._mask(r.body)) for r in rules if r.head in self._bit
                ),
                tuple(
                    (self._bit.get(fact, 0), self._bit[other])
                    for fact, other in layer.complements
                    if other in self._bit
                ),
            )

    def _moves(self) -> tuple[Move, ...]:
        best: dict[tuple[object, ...], Move] = {}
        for index, action in self._actions:
            move = self._move(index, action)
            if not (move.add or move.delete or move.conditional):
                continue
            key = (move.precondition, move.add, move.delete, move.conditional)
            if key not in best or move.cost < best[key].cost:
                best[key] = move
        return tuple(sorted(best.values(), key=lambda move: move.action))

    def _move(self, index: int, action: GroundAction) -> Move:
        precondition, add = self._mask(action.precondition), self._mask(action.add)
        delete = self._mask(action.delete)
        conditional: list[When] = []
        for effect in action.conditional:
            if not effect.condition <= self._reached:
                continue
            condition = self._mask(effect.condition) & ~precondition
            if condition:
                conditional.append(
                    When(condition, self._mask(effect.add), self._mask(effect.delete))
                )
            else:
                add |= self._mask(effect.add)
                delete |= self._mask(effect.delete)
        delete &= ~add
        useful = (When(when.condition, when.add & ~add, when.delete & ~add) for when in conditional)
        return Move(
            action=index,
            precondition=precondition,
            add=add,
            delete=delete,
            clear=delete | self._derived,
            cost=action.cost,
            conditional=tuple(when for when in useful if when.add or when.delete),
        )


def _deleted(action: GroundAction) -> frozenset[int]:
    """Every fact that an action may delete."""
    return action.delete.union(*(effect.delete for effect in action.conditional)) - action.add


def _asked(action: GroundAction) -> frozenset[int]:
    """Every fact that an action looks at."""
    return action.precondition.union(*(effect.condition for effect in action.conditional))
