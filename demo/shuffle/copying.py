"""Plugins copied with every name of their authors' own replaced, and their order mixed."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

from demo.shuffle import names as naming
from demo.shuffle import toml
from demo.shuffle.names import Names
from demo.shuffle.package import ENTRY_POINT_GROUP, Package, Table, normalised, required
from demo.shuffle.python import Literals, rewritten
from demo.shuffle.vocabulary import Core
from demo.shuffle.words import Words

_PEOPLES = ("readme", "urls")
"""What a project file says to people only; the files that it names are not copied."""
OURS = "nondum"
"""The import package that is no plugin author's."""


class NotEquivalent(Exception):
    """A copy describes itself otherwise than its original does in new names."""


@dataclass(frozen=True, slots=True)
class Shuffled:
    """The copies, and what became of each name."""

    folders: Mapping[str, Path]
    """Name of the folder that was copied → the copy."""
    payloads: tuple[Path, ...]
    """The copies that are payloads, in the order to plug them in."""
    libraries: tuple[Path, ...]
    """The copies that payloads depend on."""
    names: Names


def shuffle(folders: Sequence[Path], work: Path, *, seed: int) -> Shuffled:
    """Copy source folders of plugins, and of libraries that they share, into `work`.

    The same folders and seed give the same names and order. What people say, and what they are
    told, stays; so do the core's words. Raises `NotEquivalent` when a copy does not describe
    itself as its original does, `OSError` and `ValueError` when a folder is no package.
    """
    packages = sorted(map(Package.read, folders), key=lambda package: package.distribution)
    said = {p.distribution: p.described(folders) for p in packages}
    descriptions = [description for group in said.values() for description in group]
    words = Words(seed, taken=Core().words)
    names = naming.chosen(packages, descriptions, words)
    copies = {p.distribution: work / names.distributions[p.distribution] for p in packages}
    for package in packages:
        relevant = map(Literals.of, _relevant(package, packages, said))
        literals = reduce(Literals.__or__, relevant, Literals())
        _copy(package, copies[package.distribution], literals, names)
    for package in packages:
        copy = Package.read(copies[package.distribution])
        _compare(copy, copy.described([*copies.values()]), said[package.distribution], names)
    payloads = [p.distribution for p in packages if p.payload]
    return Shuffled(
        folders={p.folder.name: copies[p.distribution] for p in packages},
        payloads=tuple(copies[name] for name in words.shuffled(payloads)),
        libraries=tuple(copies[p.distribution] for p in packages if not p.payload),
        names=names,
    )


def sources(folders: Mapping[str, Path], work: Path, *, seed: int) -> dict[str, Path]:
    """The copy of each folder, by the same keys; nondum's own packages stay where they are.

    Raises as `shuffle` does.
    """
    own = {key for key, folder in folders.items() if OURS in Package.read(folder).packages}
    strangers = [folder for key, folder in folders.items() if key not in own]
    copies = shuffle(strangers, work, seed=seed).folders
    return {key: folder if key in own else copies[folder.name] for key, folder in folders.items()}


def _relevant(
    package: Package, packages: Iterable[Package], said: Mapping[str, list[Table]]
) -> list[Table]:
    """The descriptions that its code may speak of: its own, a library's users' too."""
    users = [p.distribution for p in packages if package.distribution in p.requires]
    return [d for name in (package.distribution, *users) for d in said[name]]


def _copy(package: Package, target: Path, literals: Literals, names: Names) -> None:
    for top in package.packages:
        for path in sorted((package.folder / top).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                relative = path.relative_to(package.folder / top)
                _copy_file(path, target / names.packages[top] / relative, literals, names)
    for pattern in package.project["project"].get("license-files", ()):
        for path in package.folder.glob(pattern):
            shutil.copyfile(path, target / path.name)
    (target / "pyproject.toml").write_text(toml.text(_project(package, names)), encoding="utf-8")
    if package.payload:
        notes = toml.text(_payload(package.payload, names))
        (target / "payload.toml").write_text(notes, encoding="utf-8")


def _copy_file(path: Path, target: Path, literals: Literals, names: Names) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".py":
        source = path.read_text(encoding="utf-8")
        target.write_text(rewritten(source, literals, names), encoding="utf-8")
    elif path.suffix == ".pddl":
        text = names.fragment(path.read_text(encoding="utf-8"))
        target.with_name(names.files[path.name]).write_text(text, encoding="utf-8")
    else:
        shutil.copyfile(path, target)


def _project(package: Package, names: Names) -> dict[str, Any]:
    project = {k: v for k, v in package.project["project"].items() if k not in _PEOPLES}
    project["name"] = names.distributions[package.distribution]
    project["dependencies"] = [_requirement(r, names) for r in project.get("dependencies", ())]
    if package.entry_points:
        project["entry-points"] = {
            ENTRY_POINT_GROUP: {
                names.entry_points[name]: _module(target, names)
                for name, target in package.entry_points.items()
            }
        }
    packages = {"packages": [names.packages[top] for top in package.packages]}
    hatch = {"hatch": {"build": {"targets": {"wheel": packages}}}}
    return {"build-system": package.project["build-system"], "project": project, "tool": hatch}


def _requirement(requirement: str, names: Names) -> str:
    new = names.distributions.get(required(requirement))
    if new is None:
        return requirement
    return new + requirement.lstrip("".join(c for c in requirement if c.isalnum() or c in "._-"))


def _module(target: str, names: Names) -> str:
    top, dot, rest = target.partition(".")
    return names.packages[top] + dot + rest


def _payload(payload: Table, names: Names) -> Table:
    components = [_component(component, names) for component in payload["component"]]
    new = names.payloads[payload["id"]]
    return payload | {"id": new, "name": new.rpartition(".")[2], "component": components}


def _component(component: Table, names: Names) -> Table:
    changed = component | {
        "id": names.components[component["id"]],
        "distribution": names.distributions[normalised(component["distribution"])],
    }
    for kind in ("device", "unit"):
        if kind in component:
            changed[kind] = [
                entry | {"name": names.words[entry["name"]]} for entry in component[kind]
            ]
    return changed


def _compare(copy: Package, now: list[Table], before: list[Table], names: Names) -> None:
    expected = [_in_order(names.description(description)) for description in before]
    for wanted, found in zip(sorted(expected, key=str), _sorted(now), strict=True):
        wrong = [key for key, value in wanted.items() if found[key] != value]
        if wrong:
            raise NotEquivalent(
                f"{copy.folder}: {wrong[0]} are {found[wrong[0]]}, expected {wanted[wrong[0]]}"
            )


def _sorted(descriptions: Iterable[Table]) -> list[Table]:
    return sorted(map(_in_order, descriptions), key=str)


def _in_order(description: Table) -> Table:
    """Behaviours and conditions are told in the order of their names."""
    kinds = ("behaviours", "conditions")
    return description | {
        kind: sorted(description[kind], key=lambda entry: str(entry["name"])) for kind in kinds
    }
