"""Which type of message the value of a fact is, by the fragments that declare it.

`(:valued position-known - gps-fix)`: the one section of PDDL that a worker reads. All else is the
host's to parse and to check (nondum.planning).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from nondum.sdk.description import Fragment

_COMMENT = re.compile(r";[^\n]*")
_SECTION = re.compile(r"\(\s*:valued\b([^()]*)\)")


def value_types(fragments: Iterable[Fragment]) -> Mapping[str, str]:
    """Predicate → type of message, for the predicates whose values have a declared type.

    >>> value_types([Fragment("domain.pddl", "(:valued seen at - pose dose - scalar heard)")])
    {'seen': 'pose', 'at': 'pose', 'dose': 'scalar'}
    """
    found: dict[str, str] = {}
    for fragment in fragments:
        text = _COMMENT.sub("", fragment.text).lower()
        for section in _SECTION.finditer(text):
            found.update(_typed(section[1].split()))
    return found


def _typed(words: list[str]) -> Iterator[tuple[str, str]]:
    names: list[str] = []
    following = iter(words)
    for word in following:
        if word == "-":
            kind = next(following, "")
            yield from ((name, kind) for name in names)
            names = []
        else:
            names.append(word)
