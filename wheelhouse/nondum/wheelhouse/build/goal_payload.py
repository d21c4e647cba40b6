"""A payload that brings no component, only goals: what `nondum payload goal` writes on a drive."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from nondum.wheelhouse.build import build
from nondum.wheelhouse.format import goals, index, manifest

VERSION = "1"
"""Such payloads differ by their releases."""


def write(
    drive: Path,
    payload_id: str,
    wanted: Sequence[str],
    *,
    release: int | None = None,
    fleet: str = "",
    hosts: tuple[str, ...] = (),
) -> Path:
    """Write one, not signed, and return its folder; replaces one of the same id.

    Raises `PayloadRefused` with what is wrong with the goals or the id.
    """
    text = f'id = "{payload_id}"\nname = "{payload_id}"\n'
    with tempfile.TemporaryDirectory(prefix="nondum-goal-") as temporary:
        folder = Path(temporary) / "payload"
        folder.mkdir()
        (folder / goals.NAME).write_bytes(goals.to_bytes(wanted))
        manifest.parse(text, manifest.NAME, brings_goals=True)
        (folder / manifest.NAME).write_text(text, encoding="utf-8")
        (folder / index.NAME).write_bytes(index.to_bytes({}))
        build.seal(folder, payload_id, VERSION, release, fleet=fleet, hosts=hosts)
        return build.deliver(folder.rename(folder.with_name(payload_id)), drive)
