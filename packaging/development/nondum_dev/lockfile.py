"""The lock as text: what pip takes with `--require-hashes`, with the comments that uv writes.

An entry is a version with its hashes, and `# via` names whose dependency it is. So the part of the
lock that some packages need can be found without asking any index.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

FIRST_LINE = re.compile(r"([A-Za-z0-9][A-Za-z0-9._-]*)==\S+")
VIA = re.compile(r" +#(?: via)? +(\S+)")


@dataclass(frozen=True, slots=True)
class Entry:
    """One version of a package, which may be for some environments only."""

    name: str
    text: str
    needed_by: frozenset[str]


def canonical(name: str) -> str:
    """A name as indexes compare it (PEP 503).

    >>> canonical("py_trees")
    'py-trees'
    """
    return re.sub(r"[-_.]+", "-", name).lower()


def parse(text: str) -> list[Entry]:
    """The entries of a lock, in its order."""
    blocks: list[list[str]] = []
    for line in text.splitlines():
        if FIRST_LINE.match(line):
            blocks.append([])
        if blocks:
            blocks[-1].append(line)
    return [_entry(block) for block in blocks]


def _entry(lines: list[str]) -> Entry:
    first = FIRST_LINE.match(lines[0])
    assert first
    comments = filter(None, map(VIA.fullmatch, lines))
    kept = [line for line in lines if not line.lstrip().startswith("#")]
    needed_by = frozenset(canonical(found[1]) for found in comments)
    return Entry(canonical(first[1]), "\n".join(kept) + "\n", needed_by)


def needed(entries: Iterable[Entry], names: Iterable[str]) -> frozenset[str]:
    """These packages, and all that they depend on.

    >>> lock = parse("a==1\\nb==1\\n    # via a\\nc==1\\n    # via\\n    #   b\\n    #   d\\n")
    >>> sorted(needed(lock, ["b"])), sorted(needed(lock, ["A"]))
    (['b', 'c'], ['a', 'b', 'c'])
    """
    found = frozenset(map(canonical, names))
    dependencies = _dependencies(entries)
    new = found
    while new:
        new = frozenset(d for name in new for d in dependencies.get(name, ())) - found
        found |= new
    return found


def _dependencies(entries: Iterable[Entry]) -> Mapping[str, set[str]]:
    dependencies: dict[str, set[str]] = {}
    for entry in entries:
        for name in entry.needed_by:
            dependencies.setdefault(name, set()).add(entry.name)
    return dependencies
