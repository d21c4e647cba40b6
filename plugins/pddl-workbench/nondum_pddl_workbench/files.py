"""PDDL files as commands are given them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nondum.sdk.errors import FragmentRefused, Problem

if TYPE_CHECKING:
    from nondum.planning.pddl.syntax import FragmentSyntax
    from nondum_pddl_workbench.standalone import Standalone

FILE = click.Path(path_type=Path, exists=True, dir_okay=False)


def text_of(path: Path) -> str:
    """The text of a file, without its byte order mark. Raises `FragmentRefused` (NOT_UTF8)."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        before = error.object[: error.start].rpartition(b"\n")[2]
        line = error.object.count(b"\n", 0, error.start) + 1
        message = f"byte {error.start + 1} is not UTF-8"
        where = f"{path}:{line}:{len(before.decode(errors='replace')) + 1}"
        fix = "save it as UTF-8"
        raise FragmentRefused(Problem("NOT_UTF8", message, where, fix=fix)) from error


def parsed(path: Path) -> FragmentSyntax:
    """A domain or a problem. Raises `FragmentRefused`."""
    from nondum.planning.pddl.parse import parse_fragment
    from nondum_pddl_workbench.standalone import SIZE_LIMIT_BYTES

    return parse_fragment(text_of(path), str(path), size_limit_bytes=SIZE_LIMIT_BYTES)


def loaded(domain: Path, problem: Path) -> Standalone:
    """A domain with a problem of it. Raises `FragmentRefused` with all that is wrong."""
    from nondum_pddl_workbench.standalone import load

    return load(text_of(domain), str(domain), text_of(problem), str(problem))
