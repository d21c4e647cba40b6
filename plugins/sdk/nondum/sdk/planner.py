"""The seam that planners are plugged in behind: a task in, a typed answer out.

A planner is an entry point in group `nondum.planners` that loads to a class with `speaks` and
`handles` attributes and a `plan` method. It runs in a separate process and is killed when it
overruns.
"""

from __future__ import annotations

from typing import ClassVar, Protocol, TypeAlias, runtime_checkable

from nondum.sdk.frozen import frozen

CONDITIONAL_EFFECTS = "conditional-effects"
"""A feature that a planner may handle: actions with effects under conditions."""
DERIVED_PREDICATES = "derived-predicates"
"""A feature that a planner may handle: facts that follow from others by rules."""


@frozen
class ConditionalEffect:
    """Changes that an action makes only where a condition holds when it is applied."""

    condition: frozenset[int]
    add: frozenset[int]
    delete: frozenset[int]


@frozen
class GroundAction:
    """An action with all its parameters bound. Facts are indices into `GroundTask.facts`.

    All conditions are read before anything changes, and what is both deleted and added holds
    afterwards. A disjunctive precondition makes several actions of one name.
    """

    name: str
    """`schema obj obj …`; the schema is `plugin.action`."""
    precondition: frozenset[int]
    add: frozenset[int]
    delete: frozenset[int]
    cost: int = 1
    conditional: tuple[ConditionalEffect, ...] = ()

    @property
    def schema(self) -> str:
        """The schema's name: `plugin.drive`."""
        return self.name.split(" ", 1)[0]

    @property
    def arguments(self) -> tuple[str, ...]:
        """The objects, in the order of the schema's parameters; the first is the actor."""
        return tuple(self.name.split(" ")[1:])


@frozen
class Rule:
    """A derived fact that holds wherever all of `body` does."""

    head: int
    body: frozenset[int]


@frozen
class Layer:
    """Derived facts that depend on each other; earlier layers are settled before it.

    In each state the rules are applied until nothing changes; after that, the second fact of each
    of `complements` holds where the first does not. Source: PDDL 2.2 (Edelkamp and Hoffmann 2004),
    stratified semantics.
    """

    rules: tuple[Rule, ...]
    complements: tuple[tuple[int, int], ...] = ()


@frozen
class GroundTask:
    """A STRIPS task: positive facts only; a relevant negated fact has a complementary fact."""

    facts: tuple[str, ...]
    """`predicate obj obj …` by index."""
    init: frozenset[int]
    """Without derived facts."""
    goal: frozenset[int]
    actions: tuple[GroundAction, ...]
    derived: tuple[Layer, ...] = ()
    """In the order in which they are settled."""

    @property
    def features(self) -> frozenset[str]:
        """What a planner must handle to be asked: `CONDITIONAL_EFFECTS`, `DERIVED_PREDICATES`."""
        conditional = {CONDITIONAL_EFFECTS for action in self.actions if action.conditional}
        return frozenset(conditional | ({DERIVED_PREDICATES} if self.derived else set()))


@frozen
class PddlTask:
    """The same task in words, for planners that ground by themselves."""

    domain: str
    problem: str


@frozen
class Plan:
    """Indices into `GroundTask.actions`, in order."""

    steps: tuple[int, ...]
    cost: int


@frozen
class PlanText:
    """A plan as a planner of `PddlTask` gives it: `action obj obj …` for each step."""

    steps: tuple[str, ...]


@frozen
class AlreadyTrue:
    """The goal holds in the initial state."""


@frozen
class Unsolvable:
    """There is no plan, and this is why: never said without a proof."""

    proof: str
    """`relaxed` (goal facts outside the delete-relaxed reachable set) or `exhausted`."""
    facts: tuple[str, ...] = ()
    """The goal facts that cannot be reached, where the proof names them."""


@frozen
class GaveUp:
    """No answer: not the same as impossible."""

    why: str


Answer: TypeAlias = Plan | AlreadyTrue | Unsolvable | GaveUp
"""What is known after a search."""

TextAnswer: TypeAlias = PlanText | AlreadyTrue | Unsolvable | GaveUp
"""What a planner of PDDL text answers."""


@runtime_checkable
class Planner(Protocol):
    """A planner of ground tasks."""

    speaks: ClassVar[str]
    """`ground`."""
    handles: ClassVar[frozenset[str]]
    """The features beyond STRIPS that it may be asked about."""

    def plan(self, task: GroundTask, deadline_s: float) -> Answer:
        """Search for at most about `deadline_s` seconds."""
        ...


@runtime_checkable
class TextPlanner(Protocol):
    """A planner of PDDL text, such as a solver that is a separate program."""

    speaks: ClassVar[str]
    """`pddl`."""
    handles: ClassVar[frozenset[str]]
    """The features beyond STRIPS that it may be asked about."""

    def plan(self, task: PddlTask, deadline_s: float) -> TextAnswer:
        """Search for at most about `deadline_s` seconds."""
        ...
