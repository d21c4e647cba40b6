"""What fragments merge into, everything with the places that it comes from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from nondum.planning.merge.effect import Effect
from nondum.planning.pddl.facts import fact
from nondum.planning.pddl.normal import Condition
from nondum.planning.pddl.syntax import Atom, Place, PredicateDeclaration, TypedName
from nondum.planning.pddl.typegraph import TypeGraph, types_or_root
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.planner import GroundAction


@dataclass(frozen=True, slots=True, order=True)
class Origin:
    """Who said something, and where."""

    component: str
    """Empty for what the core and the host say."""
    plugin: str
    version: str
    place: Place | None = field(default=None, compare=False)

    def __str__(self) -> str:
        return " ".join(filter(None, (self.plugin, self.version, str(self.place or ""))))


@frozen
class Predicate:
    """A predicate and what may stand at each position (several types mean `either`)."""

    name: str
    parameters: tuple[tuple[str, ...], ...]
    valued: bool = False
    """A typed value travels beside the fact."""
    value_type: str = ""
    """The type of message that the value is; empty: of any."""
    functional: bool = False
    """At most one last argument for each of the others."""
    origins: tuple[Origin, ...] = field(default=(), compare=False)

    @classmethod
    def declared(
        cls,
        declaration: PredicateDeclaration,
        origin: Origin,
        *,
        valued: bool = False,
        value_type: str = "",
        functional: bool = False,
    ) -> Predicate:
        """The predicate that a declaration speaks of."""
        types = tuple(types_or_root(parameter.types) for parameter in declaration.parameters)
        return cls(declaration.name, types, valued, value_type, functional, (origin,))

    @property
    def arity(self) -> int:
        """How many arguments it takes."""
        return len(self.parameters)


@frozen
class Object:
    """Something that exists."""

    name: str
    types: tuple[str, ...]
    local: str = ""
    """For a unit or stream: its name inside its component."""
    host: str = ""
    """For a unit or stream: the host of the component that owns it."""
    component: str = ""
    """For a unit or stream: the component that owns it."""
    origins: tuple[Origin, ...] = field(default=(), compare=False)


@frozen
class Action:
    """An action schema: one for all instances of a plugin."""

    name: str
    """`plugin.action`."""
    plugin: str
    parameters: tuple[TypedName, ...]
    """The first is the actor, narrowed to units of `plugin`."""
    precondition: Condition
    effect: Effect
    lasting: bool = False
    behaviour: str = ""
    """The name of the behaviour that carries it out."""
    origins: tuple[Origin, ...] = field(default=(), compare=False)

    @property
    def local(self) -> str:
        """The action's name in its fragment."""
        return self.name.rpartition(".")[2]

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """The parameters without `?`, in order."""
        return tuple(parameter.name.removeprefix("?") for parameter in self.parameters)


@frozen
class DerivedRule:
    """`head` holds for every binding of its parameters for which the condition does."""

    head: Atom
    parameters: tuple[TypedName, ...]
    condition: Condition
    origins: tuple[Origin, ...] = field(default=(), compare=False)


@frozen
class Domain:
    """The words and actions known now."""

    types: TypeGraph
    type_origins: Mapping[str, tuple[Origin, ...]]
    predicates: Mapping[str, Predicate]
    actions: Mapping[str, Action]
    derived: tuple[DerivedRule, ...] = ()
    functions: Mapping[str, Predicate] = field(default_factory=dict)
    """Functions of objects to numbers, which costs are added up from."""


@frozen
class Merged:
    """All contributions as one: what `merge` gives."""

    domain: Domain
    objects: Mapping[str, Object]
    init: Mapping[str, tuple[Origin, ...]]
    """Facts of problem fragments, each with everybody who asserts it."""
    self_host: str
    parked: Mapping[str, tuple[Origin, ...]] = field(default_factory=dict)
    """Facts that name an object which is not there."""
    values: Mapping[str, int] = field(default_factory=dict)
    """What functions give: `distance hall kitchen` → 12."""
    is_closed: bool = False
    """Nothing but actions changes facts: true of a problem in a file, not of a robot."""
    quarantined: Mapping[str, tuple[Problem, ...]] = field(default_factory=dict)
    """Components that were left out, and why."""
    warnings: tuple[Problem, ...] = ()

    def action(self, schema: str) -> Action:
        """The schema of a ground action: `merged.action(ground.schema)`. Raises `KeyError`."""
        return self.domain.actions[schema]

    def lasting(self) -> frozenset[str]:
        """The schemas whose effects hold only while they run."""
        return frozenset(a.name for a in self.domain.actions.values() if a.lasting)

    def owner(self, name: str) -> tuple[str, str]:
        """Host and component of a unit or stream. Raises `KeyError` for anything else."""
        found = self.objects[name]
        if not found.component:
            raise KeyError(name)
        return found.host, found.component

    def bound(self, ground: GroundAction) -> dict[str, str]:
        """Parameter name without `?` → object."""
        names = self.action(ground.schema).parameter_names
        return dict(zip(names, ground.arguments, strict=True))

    def streams(self, ground: GroundAction) -> tuple[str, ...]:
        """The streams that a ground action reads and writes, in the order of its parameters."""
        parameters = self.action(ground.schema).parameters
        return tuple(
            name
            for name, parameter in zip(ground.arguments, parameters, strict=True)
            if self.domain.types.all_kind_of(parameter.types, ("stream",))
        )

    def valued_facts(self, ground: GroundAction) -> tuple[str, ...]:
        """The facts among a ground action's preconditions that carry a value."""
        bound = {f"?{name}": value for name, value in self.bound(ground).items()}
        positive = self.action(ground.schema).precondition.positive
        valued = (a for a in positive if self.domain.predicates[a.predicate].valued)
        return tuple(bind(atom, bound) for atom in valued)

    def objects_of(self, *types: str) -> Iterator[str]:
        """The objects that are one of `types`, sorted."""
        graph = self.domain.types
        return (n for n, o in sorted(self.objects.items()) if graph.is_one_of(o.types, types))


def bind(atom: Atom, bound: Mapping[str, str]) -> str:
    """The fact that an atom becomes when its variables are replaced."""
    return fact(atom.predicate, *(bound.get(term.name, term.name) for term in atom.terms))


def functional_predicates(domain: Domain) -> frozenset[str]:
    """Those with one last argument at most for each of the others."""
    return frozenset(name for name, found in domain.predicates.items() if found.functional)
