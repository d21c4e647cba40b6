"""The PDDL fragment of behaviours that state what they make true, so that their author writes none.

    @behaviour("(blink ?u - lamp)", makes="(greeted ?h)")

Pure: behaviours in, a fragment out. Mistakes are told with the file and line of the behaviour, for
its author has not written the fragment; what takes all fragments to see is told at the merge.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field

from nondum.sdk.description import Fragment
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.formula import (
    EXAMPLE,
    Expression,
    FormulaWrong,
    as_text,
    check_types,
    one_formula,
    read,
    uses,
)
from nondum.sdk.frozen import frozen
from nondum.sdk.signature import ActionSignature, Parameter

NAME = "generated.pddl"

CORE_UNITS = frozenset(
    {
        *("unit", "camera", "detector", "tracker", "base", "pointer", "sensor", "speaker"),
        *("microphone", "arm", "gripper", "light"),
    }
)
CORE_TYPES = CORE_UNITS | {
    *("object", "host", "class", "target", "place", "stream", "image", "depth", "points"),
    *("detections", "twist", "pose", "audio", "text", "scalar", "gps-fix", "imu-data"),
    *("laser-scan", "battery-state", "occupancy-grid", "key-values"),
}
CORE_PREDICATES: Mapping[str, int] = {
    **dict.fromkeys(("self", "ready", "idle", "free", "flowing"), 1),
    **dict.fromkeys(("on", "output", "from", "recognises", "senses", "shows", "reported"), 2),
    **dict.fromkeys(("bearing-known", "following", "pointing", "found"), 2),
    "steers": 3,
}
"""Words of nondum-core, which need no declaration; predicates with their number of arguments."""

_HOST = re.compile(r"\?h(?![\w-])")
_QUANTIFIED_HOST = re.compile(r"(?:forall|exists)\s*\([^()]*\?h(?![\w-])")


@frozen
class StatedEffect:
    """What `@behaviour` says of its action, in PDDL."""

    makes: str
    """The effect."""
    needs: str = ""
    """What the precondition has beyond what it always has."""


@frozen
class StatedAction:
    """An action that no fragment declares."""

    signature: ActionSignature
    effect: StatedEffect
    where: str
    """File, line and behaviour, for messages."""


def with_host(signature: str, effect: StatedEffect) -> str:
    """The signature, with `?h - host` at its end where only the effect speaks of ?h.

    >>> with_host("(blink ?u - lamp)", StatedEffect("(greeted ?h)"))
    '(blink ?u - lamp ?h - host)'
    """
    said = f"{effect.makes} {effect.needs}"
    is_missing = _HOST.search(said) and not (
        _QUANTIFIED_HOST.search(said) or _HOST.search(signature)
    )
    head, bracket, rest = signature.rpartition(")")
    return f"{head.rstrip()} ?h - host){rest}" if is_missing and bracket else signature


def generated_fragments(
    actions: Sequence[StatedAction], written: Iterable[Fragment]
) -> tuple[Fragment, ...]:
    """One fragment that has the actions; none where there are none.

    `written` are the fragments that the plugin has itself. Raises `WorkerFailed` (ACTION_EFFECT)
    with everything that is wrong.
    """
    words = _words_of(written)
    actors = {name for action in actions for name in action.signature.actor.types} - words.types
    words.types.update(actors)
    declared: list[str] = []
    problems: list[Problem] = []
    for action in actions:
        try:
            declared.append(_action(action, words))
        except FormulaWrong as wrong:
            problems.append(Problem("ACTION_EFFECT", str(wrong), where=action.where, fix=wrong.fix))
    if problems:
        raise WorkerFailed(*problems)
    if not declared:
        return ()
    predicates = " ".join(f"({_typed(name, of)})" for name, of in words.generated.items())
    lines = [
        "; Made of what @behaviour states.\n(define (domain generated)",
        *([f"(:types {' '.join(sorted(actors))} - unit)"] if actors else []),
        *([f"(:predicates {predicates})"] if predicates else []),
        *declared,
    ]
    return (Fragment(NAME, "\n  ".join(lines) + ")\n"),)


@frozen
class _Words:
    """The words that a plugin has: the core's, those of its fragments, and those generated."""

    types: set[str] = field(default_factory=lambda: {*CORE_TYPES})
    predicates: dict[str, int] = field(default_factory=lambda: {**CORE_PREDICATES})
    """Predicate → number of arguments."""
    generated: dict[str, Sequence[Parameter]] = field(default_factory=dict)
    """Predicate that no fragment has → its arguments."""
    actions: set[str] = field(default_factory=set)

    def read(self, sections: Sequence[Expression]) -> None:
        """Take what the sections of a domain declare."""
        for section in sections:
            match section:
                case [":types", *names]:
                    self.types.update(name for name in names if isinstance(name, str))
                case [":predicates", *declared]:
                    self.predicates.update(_arities(declared))
                case [":action", str() as name, *_]:
                    self.actions.add(name)

    def use(self, predicate: str, arguments: Sequence[Parameter]) -> None:
        """Check a use of a predicate, and declare it where no fragment does."""
        if predicate not in self.predicates:
            self.predicates[predicate] = len(arguments)
            self.generated[predicate] = arguments
        need = self.predicates[predicate]
        if len(arguments) != need:
            message = f"predicate {predicate!r} has {len(arguments)} arguments here, else {need}"
            raise FormulaWrong(message)
        if predicate in self.generated:
            self.generated[predicate] = [
                Parameter(one.name, tuple(dict.fromkeys((*one.types, *other.types))))
                for one, other in zip(self.generated[predicate], arguments, strict=True)
            ]


def _action(action: StatedAction, words: _Words) -> str:
    """The declaration of an action. Raises `FormulaWrong`."""
    signature, effect = action.signature, action.effect
    actor = signature.actor
    if signature.name in words.actions:
        fix = "take it out of the fragment, or take `makes` out of `@behaviour`"
        raise FormulaWrong(f"action {signature.name!r} is declared already", fix)
    if CORE_TYPES.intersection(actor.types) - CORE_UNITS:
        fix = "the first parameter is the actor: add one, such as ?u - camera"
        raise FormulaWrong(f"?{actor.name} is not a unit", fix)
    if not effect.makes:
        raise FormulaWrong("it does not say what it makes", f"give `makes`: {EXAMPLE}")
    check_types(signature.parameters, words.types)
    words.actions.add(signature.name)
    variables = {f"?{parameter.name}": parameter.types for parameter in signature.parameters}
    formulas = [one_formula(text) for text in (effect.makes, effect.needs) if text]
    for formula in formulas:
        for predicate, arguments in uses(formula, variables, words.types):
            words.use(predicate, arguments)
    makes, *needs = map(as_text, formulas)
    hosts = [parameter.name for parameter in signature.parameters if parameter.types == ("host",)]
    always = [f"(ready ?{actor.name})", *(f"(on ?{actor.name} ?{host})" for host in hosts[:1])]
    return f"""(:action {signature.name}
    :parameters ({_typed("", signature.parameters).lstrip()})
    :precondition (and {" ".join([*always, *needs])})
    :effect {makes})"""


def _words_of(written: Iterable[Fragment]) -> _Words:
    """What fragments declare. One that cannot be read declares nothing; the merge says why."""
    words = _Words()
    for fragment in written:
        try:
            found = read(fragment.text)
        except FormulaWrong:
            continue
        match found:
            case [["define", ["domain", *_], *sections]]:
                words.read(sections)
    return words


def _arities(declared: Sequence[Expression]) -> Iterator[tuple[str, int]]:
    for predicate in declared:
        match predicate:
            case [str() as name, *rest]:
                yield name, sum(isinstance(one, str) and one.startswith("?") for one in rest)


def _typed(name: str, parameters: Sequence[Parameter]) -> str:
    """A name and its parameters with their types."""
    either = {p: f"(either {' '.join(p.types)})" for p in parameters if len(p.types) > 1}
    return " ".join([name, *(f"?{p.name} - {either.get(p, p.types[0])}" for p in parameters)])
