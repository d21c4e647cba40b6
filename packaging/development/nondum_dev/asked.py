"""What the checkout's distributions and groups ask for, as their `pyproject.toml` say."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from nondum_dev.lockfile import canonical

EDITABLE = "editables>=0.5"
"""What hatchling wants besides, to install a folder so that its files are read where they are."""
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def name_of(requirement: str) -> str:
    """The name that a requirement begins with.

    >>> name_of("coverage[toml]>=7.6")
    'coverage'
    """
    found = NAME.match(requirement.strip())
    if found is None:
        raise ValueError(f"{requirement!r} begins with no name of a package")
    return canonical(found[0])


def distributions(checkout: Path) -> list[Path]:
    """The folders of all distributions of a checkout."""
    return [checkout, *(file.parent for file in sorted(checkout.glob("plugins/*/pyproject.toml")))]


def own_names(checkout: Path) -> frozenset[str]:
    """Their names, which no index is asked for."""
    return frozenset(map(name_in, distributions(checkout)))


def name_in(folder: Path) -> str:
    """The name of the distribution in a folder."""
    return canonical(str(_table(folder)["project"]["name"]))


def of_distribution(folder: Path, extras: Iterable[str] | None = ()) -> Iterator[str]:
    """What a distribution needs, with these extras (all: None), to run and to be built."""
    table = _table(folder)
    yield from table["build-system"]["requires"]
    yield from table["project"].get("dependencies", ())
    optional = table["project"].get("optional-dependencies", {})
    for extra in optional if extras is None else extras:
        yield from optional[extra]


def of_group(folder: Path, group: str) -> Iterator[str]:
    """What a dependency group consists of, with those that it includes (PEP 735)."""
    for line in _table(folder)["dependency-groups"][group]:
        if isinstance(line, str):
            yield line
        else:
            yield from of_group(folder, line["include-group"])


def of_all(checkout: Path) -> list[str]:
    """All that anything in a checkout asks for of others: what its lock has to hold."""
    wanted = {EDITABLE}
    for folder in distributions(checkout):
        wanted.update(of_distribution(folder, None))
        for group in _table(folder).get("dependency-groups", {}):
            wanted.update(of_group(folder, group))
    own = own_names(checkout)
    return sorted(line for line in wanted if name_of(line) not in own)


def _table(folder: Path) -> dict[str, Any]:
    return tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))
