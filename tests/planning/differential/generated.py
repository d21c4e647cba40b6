"""Small problems made up by Hypothesis, with every feature that there is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn
from tests.planning.differential.texts import Text

from nondum.planning.pddl.syntax import type_text

TYPES = ("object", "a", "b", "c")
"""`c` is a kind of `a` and, in some domains, of `b` too."""
KINDS = {
    "object": ("object",),
    "a": ("a", "object"),
    "b": ("b", "object"),
    "c": ("c", "a", "object"),
}

_ONE = st.sampled_from([("object",), ("object",), ("a",), ("b",), ("c",), ("a", "b"), ("b", "c")])

Scope = Mapping[str, tuple[str, ...]]
"""Variable or object → its types."""


@dataclass(frozen=True)
class Words:
    """The words of one domain."""

    kinds: Mapping[str, tuple[str, ...]]
    """Type → itself and those above it."""
    objects: Mapping[str, str]
    predicates: Mapping[str, tuple[tuple[str, ...], ...]]
    derived: Mapping[str, tuple[tuple[str, ...], ...]]

    def fitting(self, scope: Scope, types: Sequence[str]) -> list[str]:
        """What may stand where something of one of `types` is asked for."""
        return [
            name
            for name, own in {**{o: (t,) for o, t in self.objects.items()}, **scope}.items()
            if any(t in self.kinds[mine] or mine in self.kinds[t] for mine in own for t in types)
        ]


@st.composite
def texts(draw: DrawFn, *, plain: bool = False) -> Text:
    """A domain and a problem; `plain` ones have no rules and no types of two parents."""
    words = draw(_words(plain=plain))
    actions = [draw(_action(words, number)) for number in range(draw(st.integers(1, 2)))]
    actions += [
        draw(_change(words, name, of, made))
        for name, of in words.predicates.items()
        for made in ("make", "unmake")
        if draw(st.booleans())
    ]
    rules = draw(_rules(words))
    types = "a b - object c - (either a b)" if "b" in words.kinds["c"] else "a b - object c - a"
    objects = " ".join(f"{name} - {type_}" for name, type_ in words.objects.items())
    everything = {**words.predicates, **words.derived}
    predicates = " ".join(_signature(name, of) for name, of in everything.items())
    facts = [
        fact
        for name, of in words.predicates.items()
        for fact in _facts(words, name, of)
        if draw(st.booleans())
    ]
    goal = " ".join(
        draw(st.lists(_formula(words, {}, tuple(everything), 2), min_size=1, max_size=3))
    )
    domain = (
        f"(define (domain made-up)\n(:types {types})\n(:constants {objects})\n"
        f"(:predicates {predicates})\n" + "\n".join((*rules, *actions)) + ")"
    )
    problem = (
        f"(define (problem made-up-1)\n(:domain made-up)\n(:init {' '.join(facts)})\n"
        f"(:goal (and {goal})))"
    )
    return Text("made-up", domain, problem, None)


@st.composite
def _words(draw: DrawFn, *, plain: bool) -> Words:
    kinds = dict(KINDS)
    if not plain and draw(st.booleans()):
        kinds["c"] = ("c", "a", "b", "object")
    types = draw(st.lists(st.sampled_from(("a", "b", "c")), min_size=2, max_size=3))
    objects = {f"o{number}": type_ for number, type_ in enumerate(types)}
    predicates = {"n": (), "p": (draw(_ONE),), "q": (draw(_ONE), draw(_ONE))}
    derived: dict[str, tuple[tuple[str, ...], ...]] = {}
    if not plain and draw(st.booleans()):
        derived = {"x": (draw(_ONE),), "y": (draw(_ONE), draw(_ONE)), "z": ()}
    return Words(kinds, objects, predicates, derived)


def _typed(variables: Scope) -> str:
    return " ".join(f"{name} - {type_text(of)}" for name, of in variables.items())


def _signature(name: str, of: Sequence[tuple[str, ...]]) -> str:
    parameters = _typed({f"?{number}": types for number, types in enumerate(of)})
    return f"({' '.join(filter(None, (name, parameters)))})"


def _facts(words: Words, name: str, of: Sequence[tuple[str, ...]]) -> list[str]:
    facts = [name]
    for types in of:
        fitting = [o for o, t in words.objects.items() if set(words.kinds[t]) & set(types)]
        facts = [f"{fact} {o}" for fact in facts for o in fitting]
    return [f"({fact})" for fact in facts]


@st.composite
def _variables(draw: DrawFn, most: int, least: int = 0) -> Scope:
    """Names that may well hide others."""
    names = draw(
        st.lists(st.sampled_from(["?u", "?v", "?w"]), min_size=least, max_size=most, unique=True)
    )
    return {name: draw(_ONE) for name in names}


@st.composite
def _atom(draw: DrawFn, words: Words, scope: Scope, predicates: Sequence[str]) -> str:
    """An atom; `(n)` where nothing else can be said."""
    name = draw(st.sampled_from(predicates))
    terms = []
    for types in {**words.predicates, **words.derived}[name]:
        fitting = words.fitting(scope, types)
        if not fitting:
            return "(n)"
        terms.append(draw(st.sampled_from(fitting)))
    return f"({' '.join((name, *terms))})"


@st.composite
def _formula(
    draw: DrawFn, words: Words, scope: Scope, predicates: Sequence[str], depth: int
) -> str:
    kinds = ["atom", "not atom", "equal"]
    if depth:
        kinds += ["and", "or", "not", "imply", "forall", "exists"]
    kind = draw(st.sampled_from(kinds))
    inner = _formula(words, scope, predicates, depth - 1)
    match kind:
        case "atom":
            return draw(_atom(words, scope, predicates))
        case "not atom":
            return f"(not {draw(_atom(words, scope, predicates))})"
        case "equal":
            fitting = sorted({*scope, *words.objects})
            return f"(= {draw(st.sampled_from(fitting))} {draw(st.sampled_from(fitting))})"
        case "and" | "or":
            return f"({kind} {' '.join(draw(st.lists(inner, max_size=3)))})"
        case "not":
            return f"(not {draw(inner)})"
        case "imply":
            return f"(imply {draw(inner)} {draw(inner)})"
        case _:
            own = draw(_variables(2))
            part = draw(_formula(words, {**scope, **own}, predicates, depth - 1))
            return f"({kind} ({_typed(own)}) {part})"


@st.composite
def _effect(draw: DrawFn, words: Words, scope: Scope, depth: int) -> str:
    kinds = ["add", "delete"] + (["and", "when", "when", "forall"] if depth else [])
    match draw(st.sampled_from(kinds)):
        case "add":
            return draw(_atom(words, scope, tuple(words.predicates)))
        case "delete":
            return f"(not {draw(_atom(words, scope, tuple(words.predicates)))})"
        case "and":
            inner = _effect(words, scope, depth - 1)
            return f"(and {' '.join(draw(st.lists(inner, max_size=3)))})"
        case "when":
            everything = (*words.predicates, *words.derived)
            condition = draw(_formula(words, scope, everything, 1))
            return f"(when {condition} {draw(_effect(words, scope, depth - 1))})"
        case _:
            own = draw(_variables(2, 1))
            part = draw(_effect(words, {**scope, **own}, depth - 1))
            return f"(forall ({_typed(own)}) {part})"


@st.composite
def _action(draw: DrawFn, words: Words, number: int) -> str:
    scope = draw(_variables(2))
    everything = (*words.predicates, *words.derived)
    condition = draw(
        st.just("(and)")
        | _atom(words, scope, everything)
        | _atom(words, scope, everything).map(lambda atom: f"(not {atom})")
        | _formula(words, scope, everything, 3)
    )
    parts = draw(st.lists(_effect(words, scope, 2), min_size=1, max_size=4))
    return (
        f"(:action act{number} :parameters ({_typed(scope)})\n"
        f"  :precondition {condition}\n  :effect (and {' '.join(parts)}))"
    )


@st.composite
def _change(draw: DrawFn, words: Words, name: str, of: Sequence[tuple[str, ...]], made: str) -> str:
    """An action that makes one atom true or false: so states are many."""
    scope = {f"?{'uvw'[number]}": types for number, types in enumerate(of)}
    atom = f"({' '.join((name, *scope))})"
    everything = (*words.predicates, *words.derived)
    condition = draw(st.just("(and)") | _formula(words, scope, everything, 1))
    effect = atom if made == "make" else f"(not {atom})"
    return (
        f"(:action {made}-{name} :parameters ({_typed(scope)})\n"
        f"  :precondition {condition} :effect {effect})"
    )


@st.composite
def _rules(draw: DrawFn, words: Words) -> list[str]:
    """Rules of each derived predicate: it may need itself, and the negation of those before it."""
    rules: list[str] = []
    below = list(words.predicates)
    for name, of in words.derived.items():
        variables = {f"?{'uvw'[number]}": types for number, types in enumerate(of)}
        head = f"({' '.join(filter(None, (name, _typed(variables))))})"
        for _ in range(draw(st.integers(1, 2))):
            condition = draw(_formula(words, variables, tuple(below), 2))
            if draw(st.booleans()):
                own = draw(_atom(words, {**variables, "?s": ("object",)}, [name]))
                condition = f"(or {condition} (exists (?s - object) (and {own} {condition})))"
            rules.append(f"(:derived {head} {condition})")
        below.append(name)
    return rules
