"""Where things are in the checkout, and what nondum is made of."""

from __future__ import annotations

import tomllib
from pathlib import Path

PACKAGING = Path(__file__).parents[2]
CHECKOUT = PACKAGING.parent
DEBIAN = PACKAGING / "debian"
LOCK = DEBIAN / "requirements.lock"
BACKEND_LOCK = DEBIAN / "backend.lock"
"""What builds the wheels of the checkout."""
DISTRIBUTIONS = (
    *("plugins/sdk", ".", "plugins/host-lamps", "plugins/host-zenoh", "plugins/lab"),
    *("plugins/pddl-workbench", "plugins/planner-pyperplan"),
)
"""Of the checkout, what is in the package. pyperplan is a separate distribution, as the DESIGN asks
of every package: it is under the GPL."""
EXTRAS = {"nondum": ("fast", "usb")}
"""Of those, the optional parts that are always installed with them."""
PYTHONS = ("3.11", "3.12", "3.13")
"""Those that the package has libraries for: Debian 12's, Ubuntu 24.04's and Debian 13's."""


def project(distribution: str) -> dict[str, object]:
    """The table `[project]` of one of the checkout's distributions."""
    text = (CHECKOUT / distribution / "pyproject.toml").read_text(encoding="utf-8")
    table: dict[str, object] = tomllib.loads(text)["project"]
    return table


def version() -> str:
    """nondum's own."""
    return str(project(".")["version"])


def declared() -> list[str]:
    """The requirements of the distributions but each other, for pip (PEP 508)."""
    own = {str(project(place)["name"]) for place in DISTRIBUTIONS}
    wanted: list[str] = []
    for place in DISTRIBUTIONS:
        table = project(place)
        wanted += _strings(table.get("dependencies"))
        extras = table.get("optional-dependencies")
        for extra in EXTRAS.get(str(table["name"]), ()):
            wanted += _strings(extras.get(extra) if isinstance(extras, dict) else None)
    return sorted({line for line in wanted if not any(_is(line, name) for name in own)})


def declared_backend() -> list[str]:
    """The requirements for building the distributions, for pip (PEP 518)."""
    wanted: set[str] = set()
    for place in DISTRIBUTIONS:
        text = (CHECKOUT / place / "pyproject.toml").read_text(encoding="utf-8")
        wanted.update(_strings(tomllib.loads(text)["build-system"]["requires"]))
    return sorted(wanted)


def _strings(value: object) -> list[str]:
    return [str(line) for line in value] if isinstance(value, list) else []


def _is(line: str, name: str) -> bool:
    return line.startswith(name) and not line[len(name) :][:1].strip("<>=!~;[ ")
