"""A new plugin package, complete and passing its own tests: what `nondum payload new` writes.

The files are those of `template/`, with `$name` and its like put in their places.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path, PurePosixPath
from string import Template
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

from nondum.sdk.errors import ConfigRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import names

_NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")
_RENAMED = {"gitignore": ".gitignore", "pyproject": "pyproject.toml"}
"""By their own names these files would work on the template."""


@frozen
class NewPackage:
    """A package that was written."""

    folder: Path
    files: tuple[Path, ...]
    """Relative to the folder, sorted."""


def new_package(name: str, folder: Path, *, payload_id: str | None = None) -> NewPackage:
    """Write a plugin package called `name` into a folder that is empty or not there.

    Raises `ConfigRefused` (NAME_INVALID, FOLDER_NOT_EMPTY).
    """
    payload_id = payload_id or f"org.example.{name}"
    problems = list(_problems(name, payload_id, folder))
    if problems:
        raise ConfigRefused(*problems)
    words = {
        "name": name,
        "module": f"nondum_{name.replace('-', '_')}",
        "payload_id": payload_id,
        "title": name.replace("-", " ").capitalize(),
        "words": name.replace("-", " "),
    }
    template = resources.files(__package__) / "template"
    files = {
        _place(path, words["module"]): Template(source.read_text(encoding="utf-8"))
        for path, source in _walk(template)
    }
    for path, text in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text.substitute(words), encoding="utf-8")
    return NewPackage(folder, tuple(sorted(Path(path) for path in files)))


def build_command(sdk: Any) -> str:
    """How to put a new package onto a drive, where the SDK was installed from `sdk`.

    `sdk` is the origin of that distribution (PEP 610), or None. An SDK that was installed from its
    source folder is in no index: the wheel of it is made from that folder.
    """
    command = "nondum payload build . -o DRIVE"
    if sdk is None or not hasattr(sdk, "dir_info"):
        return command
    return f"{command} --library {shlex.quote(url2pathname(urlsplit(sdk.url).path))}"


def _problems(name: str, payload_id: str, folder: Path) -> Iterator[Problem]:
    if not _NAME.fullmatch(name) or not names.COMPONENT_ID.fullmatch(name):
        text = f"{name!r} is not a plugin's name"
        need = "lower-case letters, digits and single hyphens, a letter first"
        yield Problem("NAME_INVALID", text, need=need, have=name)
    elif not names.PAYLOAD_ID.fullmatch(payload_id):
        text = f"{payload_id!r} is not a payload's id"
        yield Problem("NAME_INVALID", text, need="a reverse domain name", have=payload_id)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        text = "there is something in the folder already"
        yield Problem("FOLDER_NOT_EMPTY", text, where=str(folder), fix="give another with --output")


def _walk(folder: Traversable, above: str = "") -> Iterator[tuple[str, Traversable]]:
    for entry in folder.iterdir():
        path = f"{above}{entry.name}"
        if entry.is_dir():
            if entry.name != "__pycache__":
                yield from _walk(entry, f"{path}/")
        else:
            yield path, entry


def _place(path: str, module: str) -> str:
    first, *rest = PurePosixPath(path).parts
    first = module if first == "module" else _RENAMED.get(first, first)
    return "/".join([first, *rest])
