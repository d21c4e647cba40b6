"""Without a catalogue, payloads are known by what lies on disk, if that is what it was."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from tests.kit.lamp_drive import PAYLOAD, lamp, told

from nondum.host.core import payload_key
from nondum.host.jobs import noted


@pytest.fixture(params=[payload_key.DIGITS, payload_key.FORMER_DIGITS])
def kept(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A payload as this version or a former one keeps it, and the note that tells of it."""
    folder = lamp(tmp_path / "drive")
    key = hashlib.sha256((folder / "CONTENTS").read_bytes()).hexdigest()[: request.param]
    copied = shutil.copytree(folder, tmp_path / "payloads" / key)
    (tmp_path / "notes").mkdir()
    note = json.dumps({"drive": "a", "folder": str(folder)})
    (tmp_path / f"notes/{key}.json").write_text(note)
    return copied


def found(tmp_path: Path) -> list[dict[str, Any]]:
    places = {"notes": str(tmp_path / "notes"), "payloads": str(tmp_path / "payloads")}
    return noted.found(places, told)


def test_payload_that_is_whole_is_found(kept: Path, tmp_path: Path) -> None:
    (said,) = found(tmp_path)
    assert (said["key"], said["payload_id"], said["drive"]) == (kept.name, PAYLOAD, "a")
    assert said["components"] == ["lamp"]


def test_payload_under_another_s_name_is_not_brought_back(kept: Path, tmp_path: Path) -> None:
    name = "0" * len(kept.name)
    kept.rename(kept.with_name(name))
    (tmp_path / f"notes/{kept.name}.json").rename(tmp_path / f"notes/{name}.json")
    assert found(tmp_path) == []


def test_payload_under_the_start_of_its_name_is_not_brought_back(
    kept: Path, tmp_path: Path
) -> None:
    kept.rename(kept.with_name(kept.name[:8]))
    (tmp_path / f"notes/{kept.name}.json").rename(tmp_path / f"notes/{kept.name[:8]}.json")
    assert found(tmp_path) == []


def test_payload_with_changed_metadata_is_not_brought_back(kept: Path, tmp_path: Path) -> None:
    with (kept / "payload.toml").open("a") as manifest:
        manifest.write("# changed\n")
    assert found(tmp_path) == []
