"""The problems in a folder: a folder a domain, each with one domain file or one a problem."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem and its domain, in files."""

    group: str
    """The folder's name."""
    domain: Path
    problem: Path

    def __str__(self) -> str:
        return f"{self.group}/{self.problem.stem}"


def problems_in(folder: Path) -> Iterator[Problem]:
    """Every problem below a folder, in order, with `domain.pddl` or its own `pNN-domain.pddl`."""
    for path in sorted(folder.glob("*/*.pddl")):
        if path.stem != "domain" and not path.stem.endswith("-domain"):
            own = path.with_name(f"{path.stem.split('-')[0]}-domain.pddl")
            shared = path.with_name("domain.pddl")
            domain = own if own.exists() else shared
            if domain.exists():
                yield Problem(path.parent.name, domain, path)
