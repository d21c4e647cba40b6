"""An action's signature, as `@behaviour` states it: `(point ?u - pointer ?h - host)`."""

from __future__ import annotations

import keyword
import re

from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.frozen import frozen

_NAME = re.compile(r"[a-z][a-z0-9_-]*")
_TOKEN = re.compile(r"\?[^\s()]+|[()]|[^\s()?]+")


@frozen
class Parameter:
    """One parameter of an action."""

    name: str
    """Without the question mark."""
    types: tuple[str, ...]
    """One type, or the alternatives of `(either a b)`."""

    @property
    def identifier(self) -> str:
        """The name as a Python parameter: `-` becomes `_`, a keyword gets one at its end."""
        name = self.name.replace("-", "_")
        return f"{name}_" if keyword.iskeyword(name) else name


@frozen
class ActionSignature:
    """An action's name and typed parameters; the first is the actor."""

    name: str
    parameters: tuple[Parameter, ...]

    @property
    def actor(self) -> Parameter:
        """The unit that acts."""
        return self.parameters[0]


def parse_signature(text: str) -> ActionSignature:
    """Read a signature.

    >>> parse_signature("(watch ?u - tracker ?c - class)").actor
    Parameter(name='u', types=('tracker',))

    Raises `WorkerFailed` (ACTION_SIGNATURE) that says what is wrong with it.
    """
    tokens = _TOKEN.findall(text)
    if len(tokens) < 3 or tokens[0] != "(" or tokens[-1] != ")":
        raise _malformed(text, "it is not of the form `(name ?actor - type …)`")
    if not _NAME.fullmatch(tokens[1]):
        raise _malformed(text, f"{tokens[1]!r} is no name")
    parameters = _parameters(text, tokens[2:-1])
    if not parameters:
        raise _malformed(text, "it has no parameter; the first one is the acting unit")
    names = [parameter.name for parameter in parameters]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise _malformed(text, f"?{twice[0]} stands there twice")
    return ActionSignature(tokens[1], parameters)


def _parameters(text: str, tokens: list[str]) -> tuple[Parameter, ...]:
    parameters: list[Parameter] = []
    rest = list(tokens)
    while rest:
        names: list[str] = []
        while rest and rest[0].startswith("?"):
            names.append(rest.pop(0)[1:])
        if not names:
            raise _malformed(text, f"expected a ?parameter, found {rest[0]!r}")
        wrong = [name for name in names if not _NAME.fullmatch(name)]
        if wrong:
            raise _malformed(text, f"?{wrong[0]} is no name of a parameter")
        if len(rest) < 2 or rest.pop(0) != "-":
            raise _malformed(text, f"?{names[-1]} has no type (write `?{names[-1]} - type`)")
        types = _types(text, rest)
        parameters += [Parameter(name, types) for name in names]
    return tuple(parameters)


def _types(text: str, rest: list[str]) -> tuple[str, ...]:
    """Take one type, or `(either …)`, from the front of `rest`."""
    first = rest.pop(0)
    types = [first]
    if first == "(":
        types = []
        while rest and rest[0] != ")":
            types.append(rest.pop(0))
        if not rest or types[:1] != ["either"] or len(types) < 2:
            raise _malformed(text, "a type in brackets is `(either a b …)`")
        del rest[0], types[0]
    wrong = [name for name in types if not _NAME.fullmatch(name)]
    if wrong:
        raise _malformed(text, f"{wrong[0]!r} is no type")
    return tuple(types)


def _malformed(text: str, why: str) -> WorkerFailed:
    return WorkerFailed(Problem("ACTION_SIGNATURE", f"cannot read the action {text!r}: {why}"))
