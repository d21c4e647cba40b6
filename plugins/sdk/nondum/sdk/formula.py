"""A condition or an effect in PDDL, as `@behaviour` states it: the predicates that it uses."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TypeAlias

from nondum.sdk.errors import WorkerFailed
from nondum.sdk.signature import Parameter, parse_signature

DEPTH_LIMIT = 64
"""Brackets within brackets, as in fragments."""
EXAMPLE = "(lit ?h), or (and (lit ?h) (not (dark ?h)))"

Expression: TypeAlias = "str | list[Expression]"
Types: TypeAlias = Mapping[str, tuple[str, ...]]
"""Variable, with its question mark → its types."""

_TOKEN = re.compile(r"[()]|[^\s()]+")
_COMMENT = re.compile(r";[^\n]*")
_NAME = re.compile(r"[0-9]*[a-z_][a-z0-9_-]*")
_VARIABLE = re.compile(r"\?[a-z0-9_][a-z0-9_-]*")


class FormulaWrong(Exception):
    """What is wrong with a formula, and what to do."""

    def __init__(self, message: str, fix: str = "") -> None:
        super().__init__(message)
        self.fix = fix


def read(text: str) -> list[Expression]:
    """Words and lists of them, in small letters and without comments. Raises `FormulaWrong`.

    >>> read("(not (lit ?h)) ; dark")
    [['not', ['lit', '?h']]]
    """
    unclosed: list[list[Expression]] = [[]]
    for token in _TOKEN.findall(_COMMENT.sub("", text).lower()):
        if token == "(":
            unclosed.append([])
        elif token != ")":
            unclosed[-1].append(token)
        elif len(unclosed) > 1:
            unclosed[-2].append(unclosed.pop())
        else:
            raise FormulaWrong(f"{text!r} has a `)` too many")
        if len(unclosed) > DEPTH_LIMIT:
            raise FormulaWrong(f"its brackets are nested more than {DEPTH_LIMIT} deep")
    if len(unclosed) > 1:
        raise FormulaWrong(f"{text!r} has a `(` that is not closed")
    return unclosed[0]


def one_formula(text: str) -> list[Expression]:
    """The one formula in a text. Raises `FormulaWrong`."""
    match read(text):
        case [[_, *_] as formula]:
            return formula
    raise FormulaWrong(f"{text!r} is not one formula", f"write one: {EXAMPLE}")


def uses(
    formula: Expression, variables: Types, known_types: Collection[str]
) -> Iterator[tuple[str, list[Parameter]]]:
    """Each use of a predicate, with names and types of its arguments. Raises `FormulaWrong`."""
    match formula:
        case ["forall" | "exists", list() as declared, *parts]:
            own = _quantified(declared)
            check_types(own, known_types)
            variables = {**variables, **{f"?{one.name}": one.types for one in own}}
        case ["and" | "or" | "not" | "imply" | "when", *parts]:
            pass
        case ["=", *terms]:
            _check_terms(terms, variables)
            return
        case [str() as predicate, *terms] if _NAME.fullmatch(predicate):
            _check_terms(terms, variables)
            yield predicate, list(_arguments(terms, variables))
            return
        case _:
            message = f"{as_text(formula)!r} is no condition and no effect"
            raise FormulaWrong(message, f"write one: {EXAMPLE}")
    for part in parts:
        yield from uses(part, variables, known_types)


def check_types(parameters: Sequence[Parameter], known_types: Collection[str]) -> None:
    """Check that each type is declared. Raises `FormulaWrong`."""
    unknown = [n for parameter in parameters for n in parameter.types if n not in known_types]
    if unknown:
        fix = f"declare it in a fragment: (:types {unknown[0]} - object)"
        raise FormulaWrong(f"type {unknown[0]!r} is not declared", fix)


def as_text(expression: Expression) -> str:
    """An expression as PDDL, on one line."""
    return expression if isinstance(expression, str) else f"({' '.join(map(as_text, expression))})"


def _quantified(declared: Sequence[Expression]) -> tuple[Parameter, ...]:
    """The typed variables of a quantifier."""
    text = as_text(declared if isinstance(declared, list) else [*declared])
    try:
        return parse_signature(f"(variables {text[1:]}").parameters
    except WorkerFailed as failed:
        message = f"the variables {text!r} cannot be read"
        raise FormulaWrong(message, "write them as (?u - light)") from failed


def _check_terms(terms: Sequence[Expression], variables: Types) -> None:
    for term in terms:
        if not isinstance(term, str) or not (_NAME.fullmatch(term) or _VARIABLE.fullmatch(term)):
            message = f"{as_text(term)!r} stands where a parameter or a name belongs"
            fix = f"write {EXAMPLE}; an action with costs is written in a fragment"
            raise FormulaWrong(message, fix)
        if term == "self":
            raise FormulaWrong("'self' names one host, and an action serves all", "write ?h")
        if term.startswith("?") and term not in variables:
            fix = f"it has {', '.join(variables)}"
            raise FormulaWrong(f"{term} is no parameter of the action", fix)


def _arguments(terms: Sequence[Expression], variables: Types) -> Iterator[Parameter]:
    """A parameter for each term, named after its variable, if that stands there once."""
    for number, term in enumerate(terms, start=1):
        name = str(term).removeprefix("?") if terms.count(term) == 1 else f"argument-{number}"
        yield Parameter(name, variables.get(str(term), ("object",)))
