"""Data as plain files: what a payload brings of it (`[[data]]`), and what a component asks for
(`[[component.data]]`). Models and maps are data: no host unpacks or reads them, it only shows them
to the components that ask."""

from __future__ import annotations

import re

from packaging.specifiers import InvalidSpecifier, SpecifierSet
from packaging.version import InvalidVersion, Version

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import names
from nondum.wheelhouse.format.tables import Form, Table

FOLDER = "data"
"""Folder of a payload with a folder for each of its data."""
_NAME = r"[a-z0-9](?:[a-z0-9]|-(?!-)){0,62}"
_WORDS = "a name of lower-case letters, digits and single hyphens"
_FORM = Form(re.compile(_NAME), _WORDS)
_FORM_OR_NONE = Form(re.compile(f"(?:{_NAME})?"), _WORDS)


@frozen
class BroughtData:
    """Data that a payload brings."""

    name: str
    kind: str
    """What it is for, by a name that those who make and those who read it agree on:
    `onnx-detector`, `gguf`, `floor-plan`."""
    version: str
    """PEP 440."""
    files: tuple[str, ...]
    """Paths below its folder; the first is the one that a component with one file means."""

    @property
    def paths(self) -> tuple[str, ...]:
        """Its files' paths in the payload folder.

        >>> BroughtData("yolo", "onnx-detector", "1", ("yolo.onnx",)).paths
        ('data/yolo/yolo.onnx',)
        """
        return tuple(f"{FOLDER}/{self.name}/{file}" for file in self.files)


@frozen
class DataNeed:
    """Data that a component asks for."""

    name: str
    """How its plugin calls it."""
    kind: str = ""
    """Empty: any."""
    data: str = ""
    """The name of the data; empty: any of that kind."""
    version: str = ""
    """Version specifier (PEP 440); empty: any."""
    optional: bool = False
    """Whether it acts without it."""

    def is_met_by(self, kind: str, name: str, version: str) -> bool:
        """Whether some data are what it asks for.

        >>> DataNeed("weights", kind="gguf", version=">=2").is_met_by("gguf", "tiny", "2.1")
        True
        """
        wanted = SpecifierSet(self.version)
        return (
            self.kind in ("", kind)
            and self.data in ("", name)
            and wanted.contains(version, prereleases=True)
        )


def parse(table: Table) -> BroughtData:
    """Read one `[[data]]`, and close it."""
    brought = BroughtData(
        name=table.text("name", _FORM),
        kind=table.text("kind", _FORM),
        version=table.text("version", default="1"),
        files=table.texts("files"),
    )
    try:
        Version(brought.version)
    except InvalidVersion:
        table.wrong("version", f"{brought.version[:60]!r} is not a version like '1.2'")
    if not brought.files:
        table.wrong("files", "expected at least one file")
    for path in brought.paths if brought.name else ():
        if flaw := names.path_flaw(path):
            table.wrong("files", f"{path[:80]!r}: {flaw}")
    if len(set(brought.files)) < len(brought.files):
        table.wrong("files", "a file stands twice")
    table.close()
    return brought


def parse_need(table: Table) -> DataNeed:
    """Read one `[[component.data]]`, and close it."""
    need = DataNeed(
        name=table.text("name", _FORM),
        kind=table.text("kind", _FORM_OR_NONE, default=""),
        data=table.text("data", _FORM_OR_NONE, default=""),
        version=table.text("version", default=""),
        optional=table.flag("optional"),
    )
    if not (need.kind or need.data):
        table.wrong("kind", "expected the kind of the data, or their name in `data`")
    try:
        SpecifierSet(need.version)
    except InvalidSpecifier:
        table.wrong("version", f"{need.version!r} is not a version specifier like '>=1.2'")
    table.close()
    return need
