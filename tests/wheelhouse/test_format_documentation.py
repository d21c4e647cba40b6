"""The documentation of the payload format names every code and every limit that the code has."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from nondum.wheelhouse.format import contents, manifest
from nondum.wheelhouse.format.manifest import Requires

ROOT = Path(__file__).parent.parent.parent
TEXT = (ROOT / "docs/payload-format.md").read_text(encoding="utf-8")
READING = (
    *("archive", "contents", "drive", "extensions", "index", "lock", "manifest", "memory"),
    *("payload", "preflight"),
)
CODE = re.compile(r'"((?!SC_)[A-Z][A-Z0-9]+_[A-Z_0-9]+)"')
KEYS = (
    *contents.HEADER_KEYS,
    *(field.name for field in dataclasses.fields(Requires)),
    *manifest.PERMISSIONS,
)


def codes() -> set[str]:
    folder = ROOT / "wheelhouse/nondum/wheelhouse"
    names = (*READING, "wheel", "signatures")
    texts = [path.read_text() for name in names for path in folder.rglob(f"{name}.py")]
    found = {match for text in texts for match in CODE.findall(text)}
    kinds = re.findall(r'report\.add\(\s*"([A-Z]+)"', (folder / "format/tables.py").read_text())
    return found | {f"MANIFEST_{kind}" for kind in (*kinds, "VALUE", "TWICE")}


@pytest.mark.parametrize("code", sorted(codes() - {"IO_ERROR"}))
def test_every_code_is_documented(code: str) -> None:
    assert re.search(rf"\b{code}\b", TEXT)


@pytest.mark.parametrize("key", KEYS)
def test_every_key_is_documented(key: str) -> None:
    assert f"`{key}`" in TEXT


def test_the_example_is_a_contents_list() -> None:
    block = TEXT.split("## CONTENTS")[1].split("\n\n    <sha256>")[0]
    text = "".join(line.removeprefix("    ") + "\n" for line in block.strip("\n").split("\n"))
    listed = contents.parse((text.lstrip() + "\n").encode(), "documentation")
    assert listed.payload_id == "org.example.blinker"
