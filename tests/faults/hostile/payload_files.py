"""The files of a payload before they are written: valid, and cheap to change."""

from __future__ import annotations

import functools
import hashlib
import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tests.kit.payloads import Part, lock_text, make_wheel, manifest_text

from nondum.sdk.description import PluginDescription
from nondum.wheelhouse.format import contents

Sign = Callable[[bytes], bytes | None]
"""Gives the signature of a contents list; None: it has none."""


def unsigned(listed: bytes) -> None:
    """Without a signature."""
    return


@dataclass(frozen=True)
class PayloadFiles:
    """Files of a payload by path, and what its contents list says of them."""

    id: str
    files: Mapping[str, bytes]
    """What is listed, as it is listed."""
    header: Mapping[str, str] = field(default_factory=dict)
    """Header lines other than the usual ones; an empty one is left out."""
    swapped: Mapping[str, bytes] = field(default_factory=dict)
    """What lies on the drive instead of, or beside, what is listed."""
    missing: frozenset[str] = frozenset()
    """What is listed, and does not lie there."""
    relist: Callable[[list[str]], list[str]] = list
    """Changes the lines of the entries."""
    rewrite: Callable[[bytes], bytes] = bytes
    """Changes the whole list, at last."""

    @property
    def component(self) -> str:
        """Id of its only component."""
        return self.id.rpartition(".")[2]

    @property
    def lock(self) -> str:
        """Name of its lock."""
        return f"pylock.{self.component}.toml"

    def text(self, path: str) -> str:
        """A file as text."""
        return self.files[path].decode()

    def with_file(self, path: str, data: bytes | str) -> PayloadFiles:
        """Another file, or another one in its place; it is listed as it is."""
        written = data.encode() if isinstance(data, str) else data
        return replace(self, files={**self.files, path: written})

    def without(self, path: str) -> PayloadFiles:
        """Without a file, nor a word of it."""
        return replace(self, files={p: data for p, data in self.files.items() if p != path})

    def edited(self, path: str, old: str, new: str) -> PayloadFiles:
        """With other text in a file, which has the old one."""
        assert old in self.text(path), f"{old!r} is not in {path}"
        return self.with_file(path, self.text(path).replace(old, new))

    def with_index(self, change: Callable[[Any], Any]) -> PayloadFiles:
        """With another index, made of the right one."""
        return self.with_file("index.json", json.dumps(change(json.loads(self.text("index.json")))))

    def listing(self) -> bytes:
        """The contents list."""
        usual = {
            "id": self.id,
            "version": "1.0",
            "release": "1",
            "fleet": "",
            "minimum-nondum": "0.1",
            "built": "2026-01-01T00:00:00Z",
        }
        header = [
            f"{k}: {v}".rstrip() for k, v in {**usual, **self.header}.items() if v != LEFT_OUT
        ]
        entries = [f"{sha256(data)}  {len(data)}  {p}" for p, data in sorted(self.files.items())]
        lines = [contents.FORMAT, *header, "", *self.relist(entries)]
        return self.rewrite(("\n".join(lines) + "\n").encode("utf-8", "surrogateescape"))

    def write(self, drive: Path, sign: Sign) -> Path:
        """Write it on a drive; returns its folder."""
        folder = drive / "nondum" / self.id
        folder.mkdir(parents=True)
        for path, data in {**self.files, **self.swapped}.items():
            if path not in self.missing:
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_bytes(data)
        listed = self.listing()
        (folder / contents.NAME).write_bytes(listed)
        signature = sign(listed)
        if signature is not None:
            (folder / contents.SIGNATURE_NAME).write_bytes(signature)
        return folder


LEFT_OUT = "\0"
"""Value of a header that is left out."""


def sound_payload(payload_id: str, part: Part | None = None) -> PayloadFiles:
    """A sound payload with one component, called as the last part of its id."""
    component = payload_id.rpartition(".")[2]
    part = part or plain(component)
    with tempfile.TemporaryDirectory() as folder:
        wheel = _wheel(Path(folder), part)
        lock = lock_text([wheel]).encode()
        described = {part.id: part.index.to_dict()}
        return PayloadFiles(
            payload_id,
            {
                f"wheels/{wheel.name}": wheel.read_bytes(),
                f"pylock.{component}.toml": lock,
                "payload.toml": manifest_text(payload_id, [part]).encode(),
                "index.json": json.dumps({"format": 1, "components": described}).encode(),
            },
        )


def plain(component: str, **more: Any) -> Part:
    """A component that says nothing and brings nothing."""
    said = PluginDescription(name=f"test-{component}", version="1.0")
    return Part(component, "", description=said, **{"with_sdk": False, **more})


def locked(wheel: str, data: bytes, *, name: str, version: str) -> str:
    """A lock of one wheel of any bytes."""
    return (
        'lock-version = "1.0"\ncreated-by = "test"\n\n'
        f'[[packages]]\nname = "{name}"\nversion = "{version}"\n'
        f'[[packages.wheels]]\nname = "{wheel}"\npath = "wheels/{wheel}"\n'
        f'size = {len(data)}\nhashes = {{ sha256 = "{sha256(data)}" }}\n'
    )


@functools.cache
def sha256(data: bytes) -> str:
    """Hex digest."""
    return hashlib.sha256(data).hexdigest()


def _wheel(folder: Path, part: Part) -> Path:
    return make_wheel(
        folder,
        part.distribution,
        part.version,
        {f"{part.module}.py": part.source, **part.files},
        tag=part.tag,
        entry_points={"nondum.plugins": {part.id: part.module}},
    )
