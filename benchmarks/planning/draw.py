"""Draws problems by lot from a collection, before anybody looks at them: `python -m
benchmarks.planning.draw COLLECTION FOLDER`, from the root of the checkout.

COLLECTION is the folder `classical` of a checkout of github.com/AI-Planning/classical-domains. The
problems go to FOLDER, as `--domains` takes them; `drawn.toml` says which ones they are, with their
hashes. It is part of this repository: another draw is another file, and no problem is left out
since planners do badly in it.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import random
import re
import shutil
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias

LIST = Path(__file__).with_name("drawn.toml")
SEED, DOMAINS, PROBLEMS = 2026, 20, 4
OTHERS = re.compile(
    r"(no-)?(airport|assembly|barman|blocks|citycar|depot|elevators|freecell|gripper|logistics"
    r"|miconic|movie|pegsol|philosophers|psr|rovers|satellite|schedule|sokoban|tpp|transport)"
)
"""Domains that the planner was made with."""
TOO_LARGE = {"cybersec", "openstacks-strips", "trucks-strips"}
"""Their files are too large for copies of the collection that leave out what is."""
FAMILY = re.compile(r"(no-)?([a-z]+)")
"""Of versions of a domain, one is drawn: `scanalyzer-08-strips`, `scanalyzer-sat11-strips`."""

Pair: TypeAlias = tuple[str, str]
"""A domain and a problem: files of the collection."""


def main() -> None:
    """Draw, copy, and write the list, or compare with the one that is there."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("collection", type=Path)
    parser.add_argument("folder", type=Path)
    chosen = parser.parse_args()
    drawn = list(draw(chosen.collection))
    told = "".join(_row(chosen.collection, pair) for pair in drawn)
    if LIST.exists() and tomllib.loads(LIST.read_text()) != tomllib.loads(told):
        parser.error(f"what is drawn of {chosen.collection} is not what {LIST.name} says")
    LIST.write_text(told, encoding="utf-8")
    for number, (domain, problem) in enumerate(drawn):
        to = chosen.folder / Path(problem).parent.name
        to.mkdir(parents=True, exist_ok=True)
        shutil.copy(chosen.collection / domain, to / f"p{number:02}-domain.pddl")
        shutil.copy(chosen.collection / problem, to / f"p{number:02}.pddl")


def draw(collection: Path, *, domains: int = DOMAINS) -> Iterator[Pair]:
    """Problems of some domains, none of which is like one that the planner was made with."""
    lot = random.Random(SEED)
    families: dict[str, list[str]] = {}
    for name in sorted(path.parent.name for path in collection.glob("*/api.py")):
        if OTHERS.match(name) or "-opt" in name or name in TOO_LARGE:
            continue
        if found := FAMILY.match(name):
            families.setdefault(found[2], []).append(name)
    for family in sorted(lot.sample(sorted(families), domains)):
        pairs = _pairs(collection, lot.choice(families[family]))
        yield from sorted(lot.sample(pairs, min(PROBLEMS, len(pairs))))


def _pairs(collection: Path, name: str) -> Sequence[Pair]:
    """What a domain's `api.py` lists, which is data written as Python."""
    (assigned,) = ast.parse((collection / name / "api.py").read_text(encoding="utf-8")).body
    assert isinstance(assigned, ast.Assign)
    domains: list[dict[str, Any]] = ast.literal_eval(assigned.value)
    return [(domain, problem) for one in domains for domain, problem in one["problems"]]


def _row(collection: Path, pair: Pair) -> str:
    hashes = [hashlib.sha256((collection / path).read_bytes()).hexdigest() for path in pair]
    domain, problem = pair
    return f'["{problem}"]\ndomain = "{domain}"\nsha256 = ["{hashes[0]}", "{hashes[1]}"]\n'


if __name__ == "__main__":
    main()
