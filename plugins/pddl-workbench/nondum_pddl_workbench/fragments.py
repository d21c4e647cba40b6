"""Fragments of components, as files and folders on the command line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.frozen import frozen
from nondum_pddl_workbench.files import text_of

if TYPE_CHECKING:
    from nondum.planning.merge.contribution import Contribution
    from nondum.sdk.description import Unit

_F = TypeVar("_F", bound=Callable[..., Any])

HOST = "robot"
"""The host that all components are on."""
_OWNED = re.compile(r"(?:([a-z0-9_-]+):)?([a-z0-9_-]+)(?:/([a-z0-9_-]+))?=([a-z0-9_-]+)")
_NO_NAME = re.compile(r"[^a-z0-9]+")


@frozen
class Owned:
    """A unit, or an output slot of one."""

    component: str
    """Empty: any."""
    unit: str
    slot: str
    """Empty: it is the unit."""
    type: str


def _owned(_: click.Context, __: click.Parameter, words: tuple[str, ...]) -> tuple[Owned, ...]:
    """Raises `click.BadParameter`."""
    found: list[Owned] = []
    for word in words:
        match = _OWNED.fullmatch(word)
        if match is None:
            raise click.BadParameter(f"expected UNIT=TYPE or UNIT/SLOT=TYPE, found {word!r}")
        found.append(Owned(match[1] or "", match[2], match[3] or "", match[4]))
    return tuple(found)


def unit_option(command: _F) -> _F:
    """Add `--unit`: the command is given `units`, a tuple of `Owned`."""
    return click.option(
        "--unit",
        "units",
        metavar="[COMPONENT:]UNIT[/SLOT]=TYPE",
        multiple=True,
        callback=_owned,
        help="A unit, or output slot, that fragments speak of: eye=camera, eye/picture=image.",
    )(command)


def contribution_of(files: Sequence[Path], units: Sequence[Owned], name: str = "") -> Contribution:
    """The component whose fragments these are; it is named after the first unless told otherwise.

    Raises `FragmentRefused` (NOT_UTF8).
    """
    from nondum.planning.merge.contribution import Contribution
    from nondum.sdk.description import Fragment, PluginDescription

    component = name or component_name(files[0])
    description = PluginDescription(
        name=component,
        version="",
        fragments=tuple(Fragment(str(path), text_of(path)) for path in files),
        units=tuple(_units([one for one in units if one.component in ("", component)])),
    )
    made = Contribution.from_description(description, host=HOST, component=component)
    return replace(made, behaviours=None)


def contributions_of(path: Path, units: Sequence[Owned]) -> Iterator[Contribution]:
    """The components of a payload folder, or the one of another folder or of a file.

    Raises `FragmentRefused` (NOT_UTF8, FRAGMENT_MISSING), `PayloadRefused`.
    """
    from nondum.wheelhouse.format import contents

    if (path / contents.NAME).is_file():
        yield from _of_payload(path)
        return
    files = sorted(path.rglob("*.pddl")) if path.is_dir() else [path]
    if not files:
        fix = "give the folder that has the fragments"
        raise FragmentRefused(
            Problem("FRAGMENT_MISSING", "there is no *.pddl file in it", where=str(path), fix=fix)
        )
    yield contribution_of(files, units, component_name(path))


def component_name(path: Path) -> str:
    """What a component is called that is only known by its file or folder.

    >>> component_name(Path("plugins/window-opener/domain.pddl")), component_name(Path("Eye.pddl"))
    ('window-opener', 'eye')
    """
    generic = path.stem in ("domain", "problem") and path.resolve().parent.name
    name = generic or (path.resolve().name if path.is_dir() else path.stem)
    return _NO_NAME.sub("-", name.lower()).strip("-") or "component"


def _units(owned: Sequence[Owned]) -> Iterator[Unit]:
    """Units in the order in which they were first spoken of; one with slots only is a `unit`."""
    from nondum.sdk.description import Output, Unit

    for name in dict.fromkeys(one.unit for one in owned):
        mine = [one for one in owned if one.unit == name]
        types = [one.type for one in mine if not one.slot] or ["unit"]
        outputs = tuple(Output(one.slot, one.type) for one in mine if one.slot)
        yield Unit(name, types[-1], outputs)


def _of_payload(folder: Path) -> Iterator[Contribution]:
    from nondum.cli.judge import loaded_payload
    from nondum.planning.merge.contribution import Contribution

    for component, description in loaded_payload(folder).index.items():
        yield Contribution.from_description(description, host=HOST, component=component)
