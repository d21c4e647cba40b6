"""`nondum payload data` and `nondum data`: from a file to what a component is shown."""

from __future__ import annotations

from pathlib import Path

from tests.kit.command_line import nondum
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost
from tests.kit.signing import Key

READER = '"""Reads."""\n'
NEEDS = '[[component.data]]\nname = "weights"\nkind = "gguf"\n'
COLUMNS = ["DATA", "KIND", "VERSION", "SIZE", "PAYLOAD", "SHOWN_TO"]


def test_a_model_is_written_signed_and_shown(tmp_path: Path) -> None:
    key, drive = Key("alice").write(tmp_path), tmp_path / "drive"
    (tmp_path / "tiny.gguf").write_bytes(b"x" * 9)
    made = nondum(
        *("payload", "data", tmp_path / "tiny.gguf", "--kind", "gguf", "--version", "2"),
        *("-o", drive, "--sign", key),
    )
    folder = drive / "nondum/org.example.tiny"
    assert made.ok().out.startswith(f"{folder}  ")
    shown = nondum("payload", "inspect", drive).ok().out
    assert "  data tiny 2 (gguf): tiny.gguf\n" in shown
    assert "signed by SHA256:" in shown
    (payload,) = nondum("payload", "inspect", drive, "--json").ok().json["payloads"]
    assert payload["data"] == [
        {"name": "tiny", "kind": "gguf", "version": "2", "files": ["tiny.gguf"]}
    ]
    nondum("payload", "check", drive).ok()


def test_what_is_wrong_with_it_is_told(tmp_path: Path) -> None:
    odd = tmp_path / "Tiny Llama.gguf"
    odd.write_bytes(b"x")
    data = ("payload", "data", odd, "-o", tmp_path / "drive")
    nondum(*data, "--kind", "gguf").refused(1, "PATH_UNSAFE")
    odd = odd.rename(tmp_path / "tiny.gguf")
    data = ("payload", "data", odd, "-o", tmp_path / "drive")
    nondum(*data, "--kind", "Language Model").refused(1, "MANIFEST_VALUE")
    nondum(*data, "--kind", "gguf", "--version", "new").refused(1, "MANIFEST_VALUE")
    assert not (tmp_path / "drive/nondum").exists()


def test_a_component_that_waits_for_data_says_so_until_they_are_here(
    daemon: RunningHost, tmp_path: Path
) -> None:
    assert daemon.run("data").ok().out == "no data\n"
    daemon.bring("reader", Part("reader", READER, manifest=NEEDS))
    daemon.until_component("reader", "waits for weights")
    (tmp_path / "tiny.gguf").write_bytes(b"x" * 2_000_000)
    drive = tmp_path / "drive"
    nondum("payload", "data", tmp_path / "tiny.gguf", "--kind", "gguf", "-o", drive).ok()
    name = daemon.plug(drive)
    daemon.until_component("reader", "ready")
    head, row = daemon.run("data").ok().out.splitlines()
    assert head.split() == COLUMNS
    assert row.split() == ["tiny", "gguf", "1", "1.9", "MB", "org.example.tiny", "reader"]
    (said,) = daemon.run("data", "--json").ok().json
    assert (said["bytes"], said["files"], said["shown_to"]) == (
        2_000_000,
        ["tiny.gguf"],
        ["reader"],
    )
    stored = daemon.run("store", "--json").ok().json
    assert [row["used_by"] for row in stored if not row["wheel"]] == [["org.example.tiny"]]
    daemon.pull(name)
    daemon.until_component("reader", "waits for weights")
