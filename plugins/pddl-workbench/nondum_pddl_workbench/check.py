"""The command that judges PDDL files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.failure import EXIT_BAD_INPUT, tell_problem
from nondum.cli.progress import ProgressLine
from nondum.cli.session import Session
from nondum.sdk.errors import FragmentRefused, Problem
from nondum.sdk.frozen import frozen
from nondum_pddl_workbench.files import FILE, loaded, parsed, text_of
from nondum_pddl_workbench.fragments import Owned, contribution_of, unit_option

if TYPE_CHECKING:
    from nondum.planning.pddl.syntax import DomainFragment, FragmentSyntax


@frozen
class _Judged:
    """What was found in one file."""

    path: Path
    what: str
    problems: tuple[Problem, ...] = ()
    warnings: tuple[Problem, ...] = ()

    def view(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "file": str(self.path),
            "is": self.what,
            "problems": [problem.to_dict() for problem in self.problems],
            "warnings": [warning.to_dict() for warning in self.warnings],
        }


@click.command()
@click.argument("files", metavar="FILE…", nargs=-1, required=True, type=FILE)
@click.option("--fragment", is_flag=True, help="Judge them together as one component's fragments.")
@unit_option
@json_option
@click.pass_obj
def check(session: Session, files: tuple[Path, ...], fragment: bool, units: Sequence[Owned]) -> int:
    """Check domains and problems: each by itself, and problems against their domains.

    A problem belongs to the domain that it names. Of several with that name it is p01-domain.pddl
    for p01-easy.pddl, else one of the same folder, else the last one before it. Exits with 2 when
    anything is wrong.

    \b
    Examples: nondum pddl check domain.pddl problem-*.pddl
              nondum pddl check --fragment --unit eye=camera domain.pddl problem.pddl
    """
    with ProgressLine("check", is_wanted=not session.as_json) as show:
        found = _as_fragments(files, units) if fragment else _by_themselves(files, show)
        judged = tuple(found)
    is_right = not any(one.problems for one in judged)
    if session.as_json:
        render.as_json({"ok": is_right, "files": [one.view() for one in judged]})
    else:
        _tell(judged)
    return 0 if is_right else EXIT_BAD_INPUT


def _tell(judged: Sequence[_Judged]) -> None:
    for one in judged:
        for warning in one.warnings:
            tell_problem(warning, as_warning=True)
        for problem in one.problems:
            tell_problem(problem)
        if not one.problems:
            render.sentence(f"{one.path}: {one.what}")


def _as_fragments(files: Sequence[Path], units: Sequence[Owned]) -> Iterator[_Judged]:
    from nondum.planning.merge.claims import claims_of

    claims = claims_of(contribution_of(files, units))
    of_units = tuple(p for p in claims.problems if not any(_is_of(p, path) for path in files))
    if of_units:
        yield _Judged(files[0].parent, "a component", of_units)
    for path in files:
        yield _Judged(
            path,
            "a fragment",
            tuple(p for p in claims.problems if _is_of(p, path)),
            tuple(w for w in claims.warnings if _is_of(w, path)),
        )


def _is_of(problem: Problem, path: Path) -> bool:
    """Whether a problem is one with a file: it says `component version file:line:column`."""
    return f"{path}:" in problem.where or problem.where.endswith(str(path))


def _by_themselves(files: Sequence[Path], show: ProgressLine) -> Iterator[_Judged]:
    """All are parsed first, so that a problem finds its domain wherever that stands."""
    from nondum.planning.pddl.syntax import DomainFragment

    read: dict[Path, FragmentSyntax | _Judged] = {}
    for number, path in enumerate(files):
        show(f"reading {path.name}", number, len(files))
        try:
            read[path] = parsed(path)
        except FragmentRefused as refused:
            read[path] = _Judged(path, "refused", refused.problems)
    domains = {path: found for path, found in read.items() if isinstance(found, DomainFragment)}
    for number, (path, found) in enumerate(read.items()):
        show(f"checking {path.name}", number, len(read))
        if isinstance(found, _Judged):
            yield found
        elif isinstance(found, DomainFragment):
            yield _domain(path, found)
        else:
            yield _problem(path, found.name, _domain_of(path, found.domain, files, domains))


def _domain(path: Path, found: DomainFragment) -> _Judged:
    from nondum_pddl_workbench.standalone import load_domain

    what = f"domain {found.name!r}, {len(found.actions)} actions"
    try:
        load_domain(text_of(path), str(path))
    except FragmentRefused as refused:
        return _Judged(path, what, refused.problems)
    return _Judged(path, what)


def _problem(path: Path, name: str, domain: Path | None) -> _Judged:
    if domain is None:
        message = "its domain is not here, so its names are not checked"
        warning = Problem("DOMAIN_MISSING", message, where=str(path), fix="give the domain as well")
        return _Judged(path, f"problem {name!r}", (), (warning,))
    what = f"problem {name!r} of {domain}"
    try:
        return _Judged(path, what, (), loaded(domain, path).warnings)
    except FragmentRefused as refused:
        return _Judged(path, what, tuple(p for p in refused.problems if _is_of(p, path)))


def _domain_of(
    path: Path, name: str, files: Sequence[Path], domains: dict[Path, DomainFragment]
) -> Path | None:
    """Of the domains of that name: the problem's own (`p01-domain.pddl` of `p01-easy.pddl`), else
    one of its folder, else the last before it."""
    own, place = f"{path.stem.partition('-')[0]}-domain", files.index(path)

    def nearness(other: Path) -> tuple[bool, bool, bool, int]:
        is_beside, at = other.parent == path.parent, files.index(other)
        return is_beside and other.stem == own, is_beside, at < place, at if at < place else -at

    called = [other for other, domain in domains.items() if domain.name == name]
    return max(called, key=nearness, default=None)
