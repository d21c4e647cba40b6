"""A plugin's source folder, or a library's, as its author declares it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ENTRY_POINT_GROUP = "nondum.plugins"
DESCRIBE = Path(__file__).with_name("describe.py")

Table = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Package:
    """What its two TOML files say."""

    folder: Path
    project: Table
    """pyproject.toml"""
    payload: Table | None
    """payload.toml; None: a library."""

    @classmethod
    def read(cls, folder: Path) -> Package:
        """Read a source folder. Raises `OSError`, `ValueError`."""
        notes = folder / "payload.toml"
        return cls(
            folder,
            tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8")),
            tomllib.loads(notes.read_text(encoding="utf-8")) if notes.exists() else None,
        )

    @property
    def distribution(self) -> str:
        """The distribution's normalised name."""
        return normalised(self.project["project"]["name"])

    @property
    def requires(self) -> frozenset[str]:
        """Normalised names of the distributions that it depends on."""
        return frozenset(map(required, self.project["project"].get("dependencies", ())))

    @property
    def packages(self) -> tuple[str, ...]:
        """The import packages in its wheel."""
        return tuple(self.project["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"])

    @property
    def entry_points(self) -> Mapping[str, str]:
        """Its plugins: name → module, or module:attribute."""
        points = self.project["project"].get("entry-points", {})
        return dict(points.get(ENTRY_POINT_GROUP, {}))

    def described(self, beside: Sequence[Path]) -> list[Table]:
        """What its plugins say about themselves, asked in separate processes.

        `beside` are the folders of packages that it may import.
        """
        paths = os.pathsep.join(map(str, [self.folder, *beside]))
        command = [sys.executable, "-B", "-P", str(DESCRIBE)]
        return [
            json.loads(
                subprocess.run(
                    [*command, target, self.distribution],
                    stdout=subprocess.PIPE,
                    check=True,
                    env={**os.environ, "PYTHONPATH": paths},
                ).stdout
            )
            for _, target in sorted(self.entry_points.items())
        ]


def normalised(name: str) -> str:
    """A distribution's name as packaging compares it (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def required(requirement: str) -> str:
    """The normalised name that a requirement begins with.

    >>> required("Some_Thing[extra]>=1,<2")
    'some-thing'
    """
    found = re.match(r"[A-Za-z0-9._-]+", requirement)
    return normalised(found[0]) if found else ""
