"""Making and judging payloads: no host is needed."""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest
from tests.kit.beacon import BEACON, BEACON_ID
from tests.kit.command_line import in_terminal, nondum
from tests.kit.payloads import Part, installed_wheel, make_payload, make_wheel, sdk_wheel
from tests.kit.signing import Key
from tests.wheelhouse.sources import make_source

INSPECTED = """\
org.example.beacon 1.0 (release 1): Made by a test  SIZE
  built 2026-01-01T00:00:00Z (AGE ago), not signed
  component beacon: greet, shine
"""


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    make_payload(tmp_path / "drive", Part("beacon", BEACON), payload_id=BEACON_ID)
    return tmp_path / "drive"


def test_a_new_package_is_complete(tmp_path: Path) -> None:
    folder = tmp_path / "window-opener"
    made = nondum("payload", "new", "window-opener", "-o", folder, "--json").ok().json
    assert made["folder"] == str(folder)
    assert "pyproject.toml" in made["files"]
    assert all((folder / path).is_file() for path in made["files"])
    nondum("payload", "new", "window-opener", "-o", folder).refused(2, "FOLDER_NOT_EMPTY")
    nondum("payload", "new", "Window Opener", "-o", tmp_path / "b").refused(2, "NAME_INVALID")


def test_what_to_do_next_can_be_pasted_whatever_the_folder_is_called(tmp_path: Path) -> None:
    folder = tmp_path / "my cam"
    *_, last = nondum("payload", "new", "cam", "-o", folder).ok().out.splitlines()
    assert shlex.split(last.split(";")[0]) == ["next:", "cd", str(folder)]


def test_a_new_package_needs_a_folder_that_can_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    nondum("payload", "new", "x", "-o", tmp_path / "file/x").refused(1, "FILE")


def test_a_drive_is_shown_as_it_says(drive: Path) -> None:
    shown = nondum("payload", "inspect", drive).ok().out.splitlines(keepends=True)
    size = shown[0].rsplit("  ", 1)[1]
    told = "".join(shown[:3]).replace(size, "SIZE\n")
    assert re.sub(r"\([0-9]+ [a-z]+ ago\)", "(AGE ago)", told) == INSPECTED
    assert "    test_beacon-1.0-py3-none-any.whl\n" in shown
    (payload,) = nondum("payload", "inspect", drive, "--json").ok().json["payloads"]
    assert (payload["id"], payload["release"]) == (BEACON_ID, 1)
    assert [component["id"] for component in payload["components"]] == ["beacon"]


def test_a_goal_is_written_signed_and_shown(tmp_path: Path) -> None:
    key, drive = Key("alice").write(tmp_path), tmp_path / "drive"
    goal = nondum("payload", "goal", "follow me", "come back", "-o", drive, "--sign", key)
    folder = drive / "nondum/org.example.goal"
    assert goal.ok().out == f"{folder}\n"
    shown = nondum("payload", "inspect", drive).ok().out
    assert "  goal: follow me\n  goal: come back\n" in shown
    assert "signed by SHA256:" in shown
    nondum("payload", "check", drive).ok()
    nondum("payload", "goal", "go\x07", "-o", drive).refused(1, "GOAL_FILE")


def test_a_sound_drive_is_accepted(drive: Path) -> None:
    ran = nondum("payload", "check", drive)
    assert ran.code == 0
    assert ran.out.endswith("accepted\n")
    said = nondum("payload", "check", drive / "nondum" / BEACON_ID, "--json").ok().json
    assert (said["ok"], said["problems"]) == (True, [])
    assert {warning["code"] for warning in said["warnings"]} == {"PDDL_OWN_WORD"}


def test_a_terminal_shows_how_far_judging_is(drive: Path) -> None:
    shown = in_terminal("payload", "check", drive)
    assert f"\r\x1b[K{BEACON_ID}: copy 100 %\r\x1b[K" in shown


def test_what_is_wrong_is_told_and_counts(drive: Path) -> None:
    (drive / "nondum" / BEACON_ID / "payload.toml").write_text("id = 3\n", encoding="utf-8")
    ran = nondum("payload", "check", drive, "--json")
    assert ran.code == 3
    assert not ran.json["ok"]
    assert ran.json["problems"][0]["code"]
    assert nondum("payload", "check", drive).out.endswith("refused\n")


@pytest.mark.parametrize("name", ["payload.toml", "index.json", "pylock.beacon.toml", "CONTENTS"])
@pytest.mark.parametrize("verb", ["inspect", "check"])
def test_a_drive_with_garbage_is_no_crash(drive: Path, name: str, verb: str) -> None:
    (drive / "nondum" / BEACON_ID / name).write_bytes(b"\xff\x00\x1b[2J = {\n")
    ran = nondum("payload", verb, drive)
    assert ran.code in (1, 3), ran
    assert "Traceback" not in ran.err
    assert "\x1b" not in ran.out + ran.err


@pytest.mark.parametrize("name", ["payload.toml", "index.json", "pylock.beacon.toml", "CONTENTS"])
@pytest.mark.parametrize("verb", ["inspect", "check"])
def test_a_drive_with_a_file_missing_is_no_crash(drive: Path, name: str, verb: str) -> None:
    (drive / "nondum" / BEACON_ID / name).unlink()
    ran = nondum("payload", verb, drive)
    assert ran.code in (1, 3), ran
    assert "Traceback" not in ran.err


def test_an_empty_drive_says_what_a_payload_is(tmp_path: Path) -> None:
    ran = nondum("payload", "check", tmp_path)
    assert ran.code == 3
    assert "DRIVE_NOT_PAYLOAD" in ran.out


def test_version_that_goes_down_is_remarked_on(tmp_path: Path) -> None:
    """Hosts go by the release, which is newer; the build may have used the wrong sources."""
    wheels = tmp_path / "wheels"
    wheels.mkdir()
    for wheel in (sdk_wheel(), installed_wheel("pluggy")):
        shutil.copy(wheel, wheels)
    make_wheel(wheels, "msgpack", "1.2.0", {"msgpack/__init__.py": ""})
    source, python = make_source(tmp_path / "blinker"), "{}.{}".format(*sys.version_info)
    words: tuple[str | Path, ...] = ("payload", "build", source, "-o", tmp_path / "usb")
    words = (*words, "--offline", "--wheels", wheels, "--python", python)
    assert "warning" not in nondum(*words).ok().out
    said = source / "wheel.json"
    said.write_text(said.read_text().replace('"1.0"', '"0.9"'))
    assert re.search(r"warning: .*\b0\.9\b.*\b1\.0\b", nondum(*words).ok().out)


def test_a_package_that_is_none_cannot_be_built(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    ran = nondum("payload", "build", tmp_path / "empty", "-o", tmp_path / "drive", "--offline")
    ran.refused(1, "error: ")


def test_build_for_an_unknown_architecture_is_refused(tmp_path: Path) -> None:
    ran = nondum("payload", "build", tmp_path, "-o", tmp_path / "d", "--arch", "vax")
    ran.refused(2, "TARGET_UNKNOWN")


def test_installing_needs_a_host(drive: Path, tmp_path: Path) -> None:
    nowhere = tmp_path / "control.sock"
    nondum("--control", nowhere, "payload", "install", drive).refused(4, "HOST_UNREACHABLE")
