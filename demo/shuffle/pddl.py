"""The names in PDDL text, each with the part that it plays there, and their replacement.

The text is only cut into names: whether it is good PDDL is for the host to judge.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise
from typing import TypeAlias


class Part(Enum):
    """What a name stands for."""

    DOMAIN = "domain"
    """A domain or problem."""
    TYPE = "type"
    PREDICATE = "predicate"
    ACTION = "action"
    OBJECT = "object"


@dataclass(frozen=True, slots=True)
class Token:
    """A name or keyword, and where it stands."""

    text: str
    start: int

    @property
    def end(self) -> int:
        """One beyond its last character."""
        return self.start + len(self.text)


Node: TypeAlias = "Token | list[Node]"
Named: TypeAlias = tuple[Part, Token]
Rename: TypeAlias = Callable[[Part, str], str]

_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")
_CONNECTIVES = frozenset({"and", "or", "not", "imply", "when"})
_QUANTIFIERS = frozenset({"forall", "exists"})
_CHANGES = frozenset({"increase", "decrease", "assign", "scale-up", "scale-down"})
_NUMERIC = frozenset({"=", "<", ">", "<=", ">="}) | _CHANGES


def fragment(text: str) -> Iterator[Named]:
    """The names of a domain or problem.

    >>> [(part.value, t.text) for part, t in fragment("(define (problem p) (:init (on a b)))")]
    [('domain', 'p'), ('predicate', 'on'), ('object', 'a'), ('object', 'b')]
    """
    _define, title, *sections = _list(_tree(text))
    yield Part.DOMAIN, _token(_list(title)[1])
    for section in sections:
        head, *rest = _list(section)
        yield from _section(_token(head).text, rest)


def formula(text: str) -> Iterator[Named]:
    """The names of a goal."""
    yield from _formula(_tree(text))


def signature(text: str) -> Iterator[Named]:
    """The names of an action's signature: `(point ?u - pointer)`."""
    name, *parameters = _list(_tree(text))
    yield Part.ACTION, _token(name)
    yield from _typed(parameters, Part.OBJECT)


def renamed(text: str, names: Iterable[Named], rename: Rename) -> str:
    """The text with each of its names replaced, and nothing else.

    >>> goal = "(on ?x table) ; there"
    >>> renamed(goal, formula(goal), lambda part, name: name.upper())
    '(ON ?x TABLE) ; there'
    """
    pieces, done = [], 0
    for part, token in sorted(names, key=lambda named: named[1].start):
        pieces += [text[done : token.start], rename(part, token.text)]
        done = token.end
    return "".join([*pieces, text[done:]])


def _section(head: str, rest: list[Node]) -> Iterator[Named]:
    match head:
        case ":domain":
            yield Part.DOMAIN, _token(rest[0])
        case ":types":
            yield from _typed(rest, Part.TYPE)
        case ":constants" | ":objects":
            yield from _typed(rest, Part.OBJECT)
        case ":predicates" | ":functions":
            # Between functions may stand `- number`.
            for name, *parameters in (node for node in rest if isinstance(node, list)):
                yield Part.PREDICATE, _token(name)
                yield from _typed(parameters, Part.OBJECT)
        case ":valued" | ":functional":
            yield from ((Part.PREDICATE, _token(name)) for name in rest)
        case ":action":
            yield Part.ACTION, _token(rest[0])
            yield from _action_parts(rest[1:])
        case ":init" | ":goal":
            for node in rest:
                yield from _formula(node)


def _action_parts(parts: list[Node]) -> Iterator[Named]:
    for keyword, node in pairwise(parts):
        if isinstance(keyword, Token) and isinstance(node, list):
            is_typed = keyword.text == ":parameters"
            yield from _typed(node, Part.OBJECT) if is_typed else _formula(node)


def _formula(node: Node) -> Iterator[Named]:
    if isinstance(node, Token) or not node:
        return
    head, *rest = node
    operator = _token(head).text
    if operator in _CONNECTIVES:
        for inner in rest:
            yield from _formula(inner)
    elif operator in _QUANTIFIERS:
        yield from _typed(_list(rest[0]), Part.OBJECT)
        yield from _formula(rest[1])
    else:
        if operator not in _NUMERIC:
            yield Part.PREDICATE, _token(head)
        for term in rest:
            yield from _term(term)


def _term(node: Node) -> Iterator[Named]:
    if isinstance(node, list):
        yield from _formula(node)
    elif _is_name(node):
        yield Part.OBJECT, node


def _typed(nodes: list[Node], part: Part) -> Iterator[Named]:
    """`a b - type c - (either type type)`; variables are left out."""
    is_type = False
    for node in nodes:
        if isinstance(node, list):
            _either, *types = node
            yield from ((Part.TYPE, _token(name)) for name in types)
        elif node.text != "-" and _is_name(node):
            yield (Part.TYPE if is_type else part), node
        is_type = isinstance(node, Token) and node.text == "-"


def _is_name(token: Token) -> bool:
    return not token.text.startswith("?") and not token.text.replace(".", "").isdigit()


def _tree(text: str) -> Node:
    """Nested lists of tokens; raises `ValueError` when brackets do not match."""
    levels: list[list[Node]] = [[]]
    for found in _TOKEN.finditer(text.lower()):
        if found[0] == "(":
            levels.append([])
        elif found[0] == ")" and len(levels) > 1:
            done = levels.pop()
            levels[-1].append(done)
        elif not found[0].startswith(";"):
            levels[-1].append(Token(found[0], found.start()))
    if len(levels) != 1 or len(levels[0]) != 1:
        raise ValueError(f"brackets do not match: {text!r}")
    return levels[0][0]


def _token(node: Node) -> Token:
    if isinstance(node, Token):
        return node
    raise ValueError("a list stands where a name is expected")


def _list(node: Node) -> list[Node]:
    if isinstance(node, list):
        return node
    raise ValueError(f"{node.text!r} stands where a list is expected")
