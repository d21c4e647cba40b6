"""A payload's source folder: an ordinary Python package with a `payload.toml` beside its
`pyproject.toml`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from importlib_metadata import distributions
from packaging.utils import canonicalize_name

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse.format import goals, manifest
from nondum.wheelhouse.format.index import Index
from nondum.wheelhouse.format.manifest import ComponentManifest, Manifest
from nondum.wheelhouse.payload import payload

ENTRY_POINT_GROUP = "nondum.plugins"
PROJECT = "pyproject.toml"

Judge = Callable[[Index], Sequence[Problem]]
"""Finds mistakes in the plugins' PDDL; given from outside, as this package cannot parse PDDL."""


def manifest_of(package: Path) -> Manifest:
    """The manifest of a source folder. Raises `PayloadRefused` (SOURCE_INCOMPLETE, MANIFEST_…)."""
    missing = [name for name in (manifest.NAME, PROJECT) if not (package / name).is_file()]
    if missing:
        raise PayloadRefused(
            Problem(
                "SOURCE_INCOMPLETE",
                f"there is no file {' nor '.join(missing)}",
                where=str(package),
                fix="`nondum payload new` makes a complete source folder",
            )
        )
    path = package / manifest.NAME
    return manifest.parse(_text(path), str(path))


def goals_of(package: Path) -> tuple[str, ...]:
    """The goals that it brings. Raises `PayloadRefused`."""
    path = package / goals.NAME
    return goals.parse(path.read_bytes(), str(path)) if path.is_file() else ()


def data_of(package: Path, said: Manifest) -> dict[str, Path]:
    """Path in the payload → where in the source folder it is, of the data that it brings: there it
    is called the same. Raises `PayloadRefused` (SOURCE_INCOMPLETE)."""
    found = {path: package / path for brought in said.data for path in brought.paths}
    missing = [path for path, at in found.items() if not at.is_file()]
    if missing:
        raise PayloadRefused(
            *(
                Problem(
                    "SOURCE_INCOMPLETE",
                    f"there is no file {path}",
                    where=str(package),
                    fix="put the file there, or leave it out of `files`",
                )
                for path in missing
            )
        )
    return found


def description_problems(
    said: Manifest, described: Mapping[str, PluginDescription], judge: Judge
) -> tuple[Problem, ...]:
    """What the plugins say of themselves where a host would refuse it, or not plan with it."""
    disagreeing = (
        problem
        for component in said.components
        for problem in payload.disagreeing_devices(component, described[component.id])
    )
    return (*disagreeing, *judge(described))


def entry_point(package: Path, component: ComponentManifest) -> str:
    """The entry point of a component's plugin, as the folder's `pyproject.toml` declares it; of
    another distribution, as it is installed. Raises `PayloadRefused` (ENTRY_POINT, …)."""
    project = _project_of(package, component.distribution)
    if declared := _table(_table(project, "entry-points"), ENTRY_POINT_GROUP):
        return chosen(declared, component.distribution, component.id)
    return installed_entry_point(component.distribution, component.id)


def declared_version(package: Path, distribution: str) -> str:
    """The version of a distribution in the folder's `pyproject.toml`, which need not be installed;
    empty: that says none. Raises `PayloadRefused`."""
    return str(_project_of(package, distribution).get("version", ""))


def installed_entry_point(
    distribution: str, component: str, site_packages: Path | None = None
) -> str:
    """The entry point of a component's plugin among those that are installed, in `site_packages` or
    here. Read from the files, nothing is run. Raises `PayloadRefused` (ENTRY_POINT)."""
    where = {} if site_packages is None else {"path": [str(site_packages)]}
    for found in distributions(name=distribution, **where):
        points = found.entry_points.select(group=ENTRY_POINT_GROUP)
        named = {point.name: str(point.value) for point in points}
        return chosen(named, distribution, component)
    raise _no_entry_point(distribution, component, "no such distribution")


def chosen(named: Mapping[str, Any], distribution: str, component: str) -> str:
    """The entry point that is named like the component, or the only one.

    Raises `PayloadRefused` (ENTRY_POINT).
    """
    if component in named:
        return str(named[component])
    if len(named) == 1:
        return str(next(iter(named.values())))
    raise _no_entry_point(distribution, component, ", ".join(sorted(named)) or "none")


def _no_entry_point(distribution: str, component: str, have: str) -> PayloadRefused:
    return PayloadRefused(
        Problem(
            "ENTRY_POINT",
            f"{distribution} has no entry point for component {component!r}",
            where=distribution,
            need=f"{component} in group {ENTRY_POINT_GROUP}",
            have=have,
            fix=f'add [project.entry-points."{ENTRY_POINT_GROUP}"] to its pyproject.toml',
        )
    )


def _project_of(package: Path, distribution: str) -> Mapping[str, Any]:
    """What the folder's `pyproject.toml` declares of a distribution; nothing if it is another's."""
    project = _project(package / PROJECT)
    is_meant = canonicalize_name(str(project.get("name", ""))) == distribution
    return project if is_meant else {}


def _project(path: Path) -> Mapping[str, Any]:
    try:
        return _table(tomllib.loads(_text(path)), "project")
    except tomllib.TOMLDecodeError as error:
        fix = "correct the line that is named"
        wrong = Problem("BUILD_FAILED", f"is not TOML: {error}", where=str(path), fix=fix)
        raise PayloadRefused(wrong) from error


def _table(of: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = of.get(key)
    return value if isinstance(value, dict) else {}


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        text = f"byte {error.start} is not UTF-8"
        raise PayloadRefused(Problem("NOT_UTF8", text, where=str(path))) from error
