"""The PDDL fragment of behaviours that state what they make true, so that their author writes none.

    @behaviour("(blink ?u - lamp)", makes="(greeted ?h)")

Pure: statements in, a fragment out. What an author cannot see in a fragment that no one wrote is
checked here, and told with the behaviour's file and line; types are checked where all fragments are
merged.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from nondum.sdk.description import Fragment
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.signature import ActionSignature, Parameter, parse_signature

NAME = "generated.pddl"

CORE_UNITS = frozenset(
    "unit camera detector tracker base pointer sensor speaker microphone arm gripper light".split()
)
CORE_TYPES = CORE_UNITS.union(
    "object host class target place stream".split(),
    "image depth points detections twist pose audio text scalar".split(),
    "gps-fix imu-data laser-scan battery-state occupancy-grid key-values".split(),
)
CORE_PREDICATES: Mapping[str, int] = {
    **{"self": 1, "ready": 1, "idle": 1, "free": 1, "flowing": 1},
    **{"on": 2, "output": 2, "from": 2, "recognises": 2, "senses": 2, "shows": 2},
    **{"bearing-known": 2, "following": 2, "pointing": 2, "found": 2, "reported": 2, "steers": 3},
}
"""Words of nondum-core, which fragments use without declaring them: predicate → arguments."""

DEPTH_LIMIT = 64
"""Brackets within brackets, as in fragments."""

_TOKEN = re.compile(r"[()]|[^\s()]+")
_COMMENT = re.compile(r";[^\n]*")
_WORD = re.compile(r"[0-9]*[a-z_][a-z0-9_-]*")
_BODY = re.compile(r"\?h(?![\w-])")
_OWN_BODY = re.compile(r"(?:forall|exists)\s*\([^()]*\?h(?![\w-])")
_NUMERIC = frozenset(
    {"=", "<", ">", "<=", ">=", "increase", "decrease", "assign", "scale-up", "scale-down"}
)
_EXAMPLE = 'makes="(lit ?h)", or makes="(and (lit ?h) (not (dark ?h)))"'

Expression: TypeAlias = "str | list[Expression]"


@dataclass(frozen=True, slots=True)
class StatedEffect:
    """What `@behaviour` says of its action, in PDDL."""

    makes: str
    """The effect."""
    needs: str = ""
    """A precondition beyond those that every action has."""


@dataclass(frozen=True, slots=True)
class StatedAction:
    """An action that no fragment declares, and its effect."""

    signature: ActionSignature
    effect: StatedEffect
    where: str
    """File, line and behaviour, for messages."""


class _Wrong(Exception):
    """What is wrong with a statement, and what to do."""

    def __init__(self, message: str, fix: str = "") -> None:
        super().__init__(message)
        self.fix = fix


@dataclass(frozen=True, slots=True)
class _Words:
    """What fragments declare: the core's and those of the plugin."""

    types: set[str] = field(default_factory=lambda: set(CORE_TYPES))
    predicates: dict[str, int] = field(default_factory=lambda: dict(CORE_PREDICATES))
    """Predicate → arguments."""
    functions: set[str] = field(default_factory=set)
    actions: set[str] = field(default_factory=set)

    def read(self, domain: Sequence[Expression]) -> None:
        """Take over what a domain declares."""
        for section in domain:
            match section:
                case [":types", *names]:
                    self.types.update(name for name in names if isinstance(name, str))
                case [":predicates", *declared]:
                    self.predicates.update(_declared(declared))
                case [":functions", *declared]:
                    self.functions.update(name for name, _ in _declared(declared))
                case [":action", str() as name, *_]:
                    self.actions.add(name)


def with_host(signature: str, effect: StatedEffect) -> str:
    """The signature, with `?h - host` at its end where only the effect speaks of ?h.

    >>> with_host("(blink ?u - lamp)", StatedEffect("(greeted ?h)"))
    '(blink ?u - lamp ?h - host)'
    """
    said = f"{effect.makes} {effect.needs}"
    is_missing = _BODY.search(_OWN_BODY.sub("", said)) and not _BODY.search(signature)
    if not is_missing or not signature.rstrip().endswith(")"):
        return signature
    return f"{signature.rstrip()[:-1].rstrip()} ?h - host)"


def generated_fragments(
    actions: Sequence[StatedAction], written: Iterable[Fragment]
) -> tuple[Fragment, ...]:
    """One fragment with all the actions, or none. `written` are those that the plugin has itself.

    Raises `WorkerFailed` (ACTION_EFFECT) with everything that is wrong.
    """
    words = _words_of(written)
    actors = {name for action in actions for name in action.signature.actor.types} - words.types
    words.types.update(actors)
    made: dict[str, list[Parameter]] = {}
    texts: list[str] = []
    problems: list[Problem] = []
    for action in actions:
        try:
            texts.append(_action(action, words, made))
        except _Wrong as wrong:
            told = Problem("ACTION_EFFECT", str(wrong), where=action.where, fix=wrong.fix)
            problems.append(told)
    if problems:
        raise WorkerFailed(*problems)
    if not texts:
        return ()
    declared = [f"({' '.join([name, *map(_typed, of)])})" for name, of in made.items()]
    sections = [
        *([f"(:types {' '.join(sorted(actors))} - unit)"] if actors else []),
        *([f"(:predicates {' '.join(declared)})"] if declared else []),
        *(["(:functions (total-cost) - number)"] if _has_new_cost(texts, words) else []),
        *texts,
    ]
    lines = ["; Made of what @behaviour states.", "(define (domain generated)", *sections]
    return (Fragment(NAME, "\n  ".join(lines) + ")\n"),)


def _action(action: StatedAction, words: _Words, made: dict[str, list[Parameter]]) -> str:
    """The action's declaration; adds predicates that nothing declares to `made`. Raises `_Wrong`."""
    signature, effect = action.signature, action.effect
    if signature.name in words.actions:
        fix = "take it out of the fragment, or leave out `makes`"
        raise _Wrong(f"action {signature.name!r} is declared already", fix)
    words.actions.add(signature.name)
    actor = signature.actor
    if not CORE_UNITS.issuperset(CORE_TYPES.intersection(actor.types)):
        raise _Wrong(f"?{actor.name}, the first parameter, is not a unit", "add one: ?u - camera")
    known = {f"?{parameter.name}": parameter.types for parameter in signature.parameters}
    _check_types(signature.parameters, words)
    if not effect.makes:
        raise _Wrong("it does not say what it makes", f"say it: {_EXAMPLE}")
    makes = _formula("makes", effect.makes)
    needs = _formula("needs", effect.needs) if effect.needs else None
    for formula in filter(None, (makes, needs)):
        for predicate, arguments in _uses(formula, known, words):
            _declare(predicate, arguments, words, made)
    hosts = [parameter.name for parameter in signature.parameters if parameter.types == ("host",)]
    conditions = [
        f"(ready ?{actor.name})",
        *(f"(on ?{actor.name} ?{host})" for host in hosts[:1]),
        *([_text(needs)] if needs else []),
    ]
    return "\n    ".join(
        [
            f"(:action {signature.name}",
            f":parameters ({' '.join(map(_typed, signature.parameters))})",
            f":precondition (and {' '.join(conditions)})",
            f":effect {_text(makes)})",
        ]
    )


def _declare(
    predicate: str,
    arguments: Sequence[Parameter],
    words: _Words,
    made: dict[str, list[Parameter]],
) -> None:
    """Check a use of a predicate; declare it, or widen its declaration, where no fragment has it."""
    if predicate not in words.predicates:
        words.predicates[predicate] = len(arguments)
        made[predicate] = []
    if words.predicates[predicate] != len(arguments):
        need = words.predicates[predicate]
        raise _Wrong(f"predicate {predicate!r} has {len(arguments)} arguments here, else {need}")
    if predicate in made:
        known = made[predicate] or arguments
        made[predicate] = [
            Parameter(one.name, tuple(dict.fromkeys((*one.types, *other.types))))
            for one, other in zip(known, arguments, strict=True)
        ]


def _uses(
    formula: Expression, known: Mapping[str, tuple[str, ...]], words: _Words
) -> Iterator[tuple[str, list[Parameter]]]:
    """Each use of a predicate, with names and types of its arguments. Raises `_Wrong`."""
    match formula:
        case ["forall" | "exists", list() as variables, *parts]:
            own = _variables(variables)
            _check_types(own, words)
            known = {**known, **{f"?{one.name}": one.types for one in own}}
        case ["and" | "or" | "not" | "imply" | "when", *parts]:
            pass
        case [str() as head, *terms] if head in _NUMERIC:
            for term in terms:
                _check_terms(term if isinstance(term, list) else [term], known)
            return
        case [str() as head, *terms] if _WORD.fullmatch(head):
            _check_terms(terms, known)
            yield head, list(_arguments(terms, known))
            return
        case _:
            raise _Wrong(f"{_text(formula)!r} is no condition and no effect", _EXAMPLE)
    for part in parts:
        yield from _uses(part, known, words)


def _arguments(
    terms: Sequence[Expression], known: Mapping[str, tuple[str, ...]]
) -> Iterator[Parameter]:
    """A parameter for each term; names are the variables', but for those that stand there twice."""
    for number, term in enumerate(terms, start=1):
        name = str(term).removeprefix("?") if terms.count(term) == 1 else f"x{number}"
        yield Parameter(name, known.get(str(term), ("object",)))


def _check_terms(terms: Sequence[Expression], known: Mapping[str, tuple[str, ...]]) -> None:
    for term in terms:
        if not isinstance(term, str):
            raise _Wrong(f"{_text(term)!r} stands where a parameter or a name belongs")
        if term == "self":
            raise _Wrong("`self` names one host, and an action serves all", "write ?h")
        if term.startswith("?") and term not in known:
            listed = ", ".join(known)
            raise _Wrong(f"{term} is no parameter of its action", f"it has {listed}")


def _check_types(parameters: Sequence[Parameter], words: _Words) -> None:
    unknown = [n for parameter in parameters for n in parameter.types if n not in words.types]
    if unknown:
        fix = f"declare it in a fragment: (:types {unknown[0]} - object)"
        raise _Wrong(f"type {unknown[0]!r} is not declared", fix)


def _variables(variables: Sequence[Expression]) -> tuple[Parameter, ...]:
    """The typed variables of a quantifier. Raises `_Wrong`."""
    text = _text(["variables", *variables])
    try:
        return parse_signature(text).parameters
    except WorkerFailed as failed:
        raise _Wrong(failed.problems[0].message.replace("the action", "the variables")) from failed


def _formula(what: str, text: str) -> list[Expression]:
    """The one formula in a text. Raises `_Wrong`."""
    match _read(what, text):
        case [[_, *_] as formula]:
            return formula
    raise _Wrong(f"`{what}` is {text!r}, not one formula", f"write one, as in {_EXAMPLE}")


def _read(what: str, text: str) -> list[Expression]:
    """Lists of words and lists, in small letters and without comments. Raises `_Wrong`."""
    unclosed: list[list[Expression]] = [[]]
    for token in _TOKEN.findall(_COMMENT.sub("", text).lower()):
        if token == "(":
            unclosed.append([])
        elif token != ")":
            unclosed[-1].append(token)
        elif len(unclosed) > 1:
            unclosed[-2].append(unclosed.pop())
        else:
            raise _Wrong(f"`{what}` is {text!r}, with a `)` too many")
        if len(unclosed) > DEPTH_LIMIT:
            raise _Wrong(f"`{what}` has brackets more than {DEPTH_LIMIT} deep")
    if len(unclosed) > 1:
        raise _Wrong(f"`{what}` is {text!r}, with a `(` that is not closed")
    return unclosed[0]


def _words_of(written: Iterable[Fragment]) -> _Words:
    """What is declared. A fragment that cannot be read declares nothing; merging says why."""
    words = _Words()
    for fragment in written:
        try:
            read = _read(fragment.name, fragment.text)
        except _Wrong:
            continue
        match read:
            case [["define", ["domain", *_], *sections]]:
                words.read(sections)
    return words


def _declared(predicates: Sequence[Expression]) -> Iterator[tuple[str, int]]:
    for predicate in predicates:
        match predicate:
            case [str() as name, *rest]:
                yield name, sum(isinstance(r, str) and r.startswith("?") for r in rest)


def _has_new_cost(texts: Sequence[str], words: _Words) -> bool:
    return "total-cost" not in words.functions and any("(total-cost)" in text for text in texts)


def _typed(parameter: Parameter) -> str:
    types = " ".join(parameter.types)
    return f"?{parameter.name} - {f'(either {types})' if len(parameter.types) > 1 else types}"


def _text(expression: Expression) -> str:
    return expression if isinstance(expression, str) else f"({' '.join(map(_text, expression))})"
