"""Whole payload folders: what hangs together passes, every contradiction is told."""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.kit.payloads import Part, make_payload, make_wheel, seal
from tests.wheelhouse.hostile_wheels import WheelBuilder

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.wheelhouse.build.verification import verify
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.signatures import UnsignedAllowed
from nondum.wheelhouse.payload import drive, host_facts, payload
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.payload import StagedPayload, check_wheels, is_metadata, load

PLAIN = Part("blinker", "X = 1\n", with_sdk=False)
ID = "org.example.test"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_payload(tmp_path / "drive", PLAIN)


@pytest.fixture
def facts(tmp_path: Path) -> HostFacts:
    return host_facts.probe(tmp_path, reserve_mb=0, confinement=Level.NONE)


def check(folder: Path, facts: HostFacts | None = None) -> tuple[Problem, ...]:
    return verify(folder, UnsignedAllowed(), facts).problems


def staged(folder: Path, tmp_path: Path) -> StagedPayload:
    listed = contents.parse(drive.read_contents(folder), "CONTENTS")
    drive.copy(folder, listed, tmp_path / "staging")
    return load(tmp_path / "staging", listed)


def test_a_whole_payload_passes(tmp_path: Path, facts: HostFacts) -> None:
    folder = make_payload(tmp_path / "drive", Part("blinker", "X = 1\n"), Part("other", "Y = 2\n"))
    assert check(folder, facts) == ()
    payload = staged(folder, tmp_path)
    assert set(payload.locks) == set(payload.index) == {"blinker", "other"}
    assert {w.name for w in payload.wheels(facts)["other"]} == {
        "test-other",
        "nondum-sdk",
        "pluggy",
        "msgpack",
    }


def resealed(folder: Path, change: Callable[[Path], None]) -> tuple[str, ...]:
    change(folder)
    seal(folder, payload_id=ID)
    return tuple(dict.fromkeys(p.code for p in check(folder)))


def rewrite(name: str, old: str, new: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))

    return change


def components(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    def changed(folder: Path) -> None:
        said = json.loads((folder / "index.json").read_text())
        change(said["components"])
        (folder / "index.json").write_text(json.dumps(said))

    return changed


def replace_wheel(folder: Path) -> None:
    """Another wheel of the same name; the lock still has the hash of the first."""
    (wheel,) = (folder / "wheels").iterdir()
    make_wheel(folder / "wheels", "test-blinker", "1.0", {"test_blinker.py": "X = 2"})
    assert wheel.exists()


CONTRADICTIONS = {
    "id": (("MANIFEST_VALUE",), rewrite("payload.toml", ID, "org.example.other")),
    "no-manifest": (("FILE_MISSING",), lambda f: (f / "payload.toml").unlink()),
    "manifest-encoding": (("NOT_UTF8",), lambda f: (f / "payload.toml").write_bytes(b"\xff")),
    "no-lock": (("FILE_MISSING",), lambda f: (f / "pylock.blinker.toml").unlink()),
    "no-index": (("FILE_MISSING",), lambda f: (f / "index.json").unlink()),
    "index-not-json": (("INDEX_INVALID",), lambda f: (f / "index.json").write_text("{")),
    "index-deep": (("INDEX_INVALID",), lambda f: (f / "index.json").write_text("[" * 100_000)),
    "index-format": (("INDEX_INVALID",), rewrite("index.json", '"format": 1', '"format": 2')),
    "index-list": (("INDEX_INVALID",), lambda f: (f / "index.json").write_text("[]")),
    "index-shape": (
        ("INDEX_INVALID",),
        lambda f: (f / "index.json").write_text('{"format": 1, "components": []}'),
    ),
    "index-huge": (("TOO_LARGE",), lambda f: (f / "index.json").write_text(" " * (5 * 1024**2))),
    "index-unknown-key": (
        ("DESCRIPTION_INVALID",),
        rewrite("index.json", '"behaviours"', '"behaviors"'),
    ),
    "other-devices": (
        ("DEVICE_RULES",),
        components(
            lambda said: said["blinker"].update(devices=[{"name": "lamp", "match": {"usb": "*:*"}}])
        ),
    ),
    "index-component": (("INDEX_INVALID",), rewrite("index.json", '"blinker"', '"other"')),
    "index-lacks-a-component": (("INDEX_INVALID",), components(lambda said: said.clear())),
    "index-has-another-component": (
        ("INDEX_INVALID",),
        components(lambda said: said.update(other=said["blinker"])),
    ),
    "wheel-other-than-locked": (("LOCK_PATH",), replace_wheel),
    "locked-but-absent": (("LOCK_PATH",), lambda f: shutil.rmtree(f / "wheels")),
    "lock-size": (("LOCK_PATH",), rewrite("pylock.blinker.toml", "size = ", "size = 1")),
}


@pytest.mark.parametrize(("codes", "change"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_a_contradiction_is_told(
    folder: Path, codes: tuple[str, ...], change: Callable[[Path], None]
) -> None:
    assert resealed(folder, change) == codes


def test_the_problems_of_all_parts_are_told_at_once(folder: Path) -> None:
    def harm(folder: Path) -> None:
        (folder / "payload.toml").write_text((folder / "payload.toml").read_text() + "\nodd = 1\n")
        (folder / "index.json").write_text("{")
        (folder / "pylock.blinker.toml").write_text("= 3")

    assert set(resealed(folder, harm)) >= {"MANIFEST_KEY", "INDEX_INVALID"}


def test_a_hostile_wheel_is_found_by_checking(tmp_path: Path, facts: HostFacts) -> None:
    (tmp_path / "w").mkdir()
    evil = WheelBuilder(files={"evil/__init__.py": b"", "evil.pth": b"import os"})
    part = Part("blinker", "X = 1\n", with_sdk=False, wheels=[evil.write(tmp_path / "w")])
    folder = make_payload(tmp_path / "drive", part)
    assert [p.code for p in check(folder)] == ["WHEEL_STARTUP_HOOK"]
    assert [p.code for p in check_wheels(staged(folder, tmp_path), facts)] == ["WHEEL_STARTUP_HOOK"]


def test_a_missing_dependency_is_told(tmp_path: Path, facts: HostFacts) -> None:
    (tmp_path / "w").mkdir()
    needy = make_wheel(tmp_path / "w", "needy", "1", {"needy.py": ""}, requires=["absent>=2"])
    part = Part("blinker", "X = 1\n", with_sdk=False, wheels=[needy])
    (problem,) = check(make_payload(tmp_path / "drive", part), facts)
    assert (problem.code, problem.need, problem.have) == ("LOCK_INCOMPLETE", "absent>=2", "none")
    assert problem.where == "pylock.blinker.toml"


def test_wheels_that_unpack_to_more_than_the_free_space_are_refused(
    tmp_path: Path, facts: HostFacts
) -> None:
    (tmp_path / "w").mkdir()
    roomy = WheelBuilder(files={"evil/__init__.py": b"", "evil/zeros": bytes(8 * 1024**2)})
    part = Part("blinker", "X = 1\n", with_sdk=False, wheels=[roomy.write(tmp_path / "w")])
    payload = staged(make_payload(tmp_path / "drive", part), tmp_path)
    (problem,) = check_wheels(payload, replace(facts, free_disk_mb=8))
    assert (problem.code, problem.need, problem.have) == ("DISK_FULL", "9 MB", "8 MB")
    assert check_wheels(payload, replace(facts, free_disk_mb=9)) == ()


def test_preflight_is_part_of_checking(tmp_path: Path, facts: HostFacts) -> None:
    folder = make_payload(tmp_path / "drive", PLAIN, requires='python = ">=9"\ndisk_mb = 999999999')
    assert check(folder) == ()
    assert [p.code for p in check(folder, facts)] == ["PYTHON_VERSION", "DISK_FULL"]


def test_metadata_is_what_is_judged_before_wheels_are_copied(folder: Path) -> None:
    listed = contents.parse(drive.read_contents(folder), "CONTENTS")
    metadata = {e.path for e in listed.entries if is_metadata(e.path)}
    assert metadata == {"index.json", "payload.toml", "pylock.blinker.toml"}


@pytest.mark.parametrize("seed", range(8))
def test_any_changed_byte_is_refused(folder: Path, seed: int) -> None:
    """Of any file that the list names: signed parts cannot be mixed."""
    chance = random.Random(seed)
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and p.name != "CONTENTS"):
        data = bytearray(path.read_bytes())
        data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        whole = path.read_bytes()
        path.write_bytes(data)
        assert [p.code for p in check(folder)] == ["HASH_MISMATCH"]
        path.write_bytes(whole)
    assert check(folder) == ()


def test_unlisted_files_are_never_read(folder: Path, tmp_path: Path) -> None:
    os.mkfifo(folder / "pipe")
    (folder / "wheels/extra.whl").write_text("not a wheel")
    (folder / "pylock.extra.toml").symlink_to("/etc/passwd")
    assert check(folder) == ()


def test_a_pulled_drive_is_told(tmp_path: Path) -> None:
    assert [p.code for p in check(tmp_path / "gone" / ID)] == ["DRIVE_GONE"]


def test_a_refusal_is_one_error_with_all(folder: Path, tmp_path: Path) -> None:
    (folder / "payload.toml").write_text("id = 3\n")
    seal(folder, payload_id=ID)
    listed = contents.parse(drive.read_contents(folder), "CONTENTS")
    drive.copy(folder, listed, tmp_path / "staging")
    with pytest.raises(PayloadRefused) as refused:
        load(tmp_path / "staging", listed)
    assert len(refused.value.problems) >= 3
    assert json.dumps([p.to_dict() for p in refused.value.problems])


@pytest.mark.parametrize(
    ("path", "most"),
    [
        ("payload.toml", 64 * 1024),
        ("pylock.blinker.toml", 1024 * 1024),
        ("index.json", 4 * 1024 * 1024),
        ("leaflet.pdf", payload.MAX_METADATA),
    ],
)
def test_metadata_that_is_too_long_is_refused_by_the_list(path: str, most: int) -> None:
    """Nothing of it is copied first; wheels are another matter."""

    def listed(*entries: contents.Entry) -> contents.Contents:
        return contents.Contents(ID, "1.0", 1, "", "0.1", "2026-01-01T00:00:00Z", entries)

    def entry(path: str, size: int) -> contents.Entry:
        return contents.Entry("0" * 64, size, path)

    wheel = entry("wheels/a-1-py3-none-any.whl", 2**30)
    assert not list(payload.oversized(listed(entry(path, most), wheel)))
    (first, *_) = payload.oversized(listed(entry(path, most + 1), wheel))
    assert (first.code, first.where) == ("TOO_LARGE", path)
    halves = (entry("a", payload.MAX_METADATA - 1), entry("b", 2))
    assert [problem.code for problem in payload.oversized(listed(*halves))] == ["TOO_LARGE"]
