"""`nondum payload verify` on the command line: what people and programs are told, and the code."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.command_line import nondum
from tests.kit.payloads import Part, make_payload, make_wheel, seal
from tests.kit.running_host import running

ID = "org.example.test"
PLAIN = Part("blinker", "X = 1\n", with_sdk=False)


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    make_payload(tmp_path / "drive", PLAIN)
    return tmp_path / "drive"


@pytest.fixture
def trust(tmp_path: Path) -> Path:
    """A trust file by which payloads that the key `alice` signed may come."""
    nondum("keys", "new", tmp_path / "alice").ok()
    file = tmp_path / "trust.toml"
    nondum("keys", "init", file, "--owner", "survey", "--root", tmp_path / "alice.pub").ok()
    given = ("--name", "alice", "--payloads", "org.example")
    nondum("keys", "allow", file, tmp_path / "alice.pub", *given).ok()
    return file


def test_what_is_signed_by_a_trusted_key_is_accepted(drive: Path, trust: Path) -> None:
    nondum("payload", "sign", drive, "--key", trust.parent / "alice").ok()
    ran = nondum("payload", "verify", drive, "--trust", trust, "--json").ok()
    assert ran.json == {"ok": True, "problems": [], "warnings": [], "signers": {ID: ["alice"]}}


def test_what_was_changed_after_it_was_signed_is_refused(drive: Path, trust: Path) -> None:
    nondum("payload", "sign", drive, "--key", trust.parent / "alice").ok()
    seal(drive / "nondum" / ID, payload_id=ID, version="2.0")
    ran = nondum("payload", "verify", drive, "--trust", trust)
    assert ran.code == 3
    assert ran.out.startswith(f"{ID}: no signature of it holds\nSIG_INVALID ")
    assert ran.out.endswith("\nrefused\n")


def test_every_problem_has_its_four_keys(drive: Path) -> None:
    (drive / "nondum" / ID / "payload.toml").write_text("id = 1\n")
    ran = nondum("payload", "verify", drive, "--json")
    assert (ran.code, ran.json["ok"]) == (3, False)
    assert {row["code"] for row in ran.json["problems"]} == {"SIG_MISSING", "HASH_MISMATCH"}
    for row in ran.json["problems"]:
        assert {"code", "where", "message", "fix"} <= row.keys()
        assert row["message"] and row["fix"]


@pytest.mark.parametrize("verb", ["verify", "check", "inspect"])
def test_endless_versions_are_refused_like_other_wrong_ones(drive: Path, verb: str) -> None:
    listed = drive / "nondum" / ID / "CONTENTS"
    text = listed.read_text()
    assert "version: 1.0\n" in text
    listed.write_text(text.replace("version: 1.0\n", f"version: {'9' * 5_000}\n"))
    ran = nondum("payload", verb, drive, "--json")
    assert "CONTENTS_HEADER" in {row["code"] for row in ran.json["problems"]}
    assert not ran.err


def test_a_folder_that_is_none_has_problems_too(tmp_path: Path) -> None:
    ran = nondum("payload", "verify", tmp_path, "--json")
    assert (ran.code, [row["code"] for row in ran.json["problems"]]) == (3, ["DRIVE_NOT_PAYLOAD"])


def test_signatures_may_be_left_unasked(drive: Path) -> None:
    assert nondum("payload", "verify", drive, "--unsigned").ok().out.endswith("accepted\n")
    assert nondum("payload", "check", drive).ok().out.endswith("accepted\n")


def test_valid_signatures_are_told_although_no_trust_is_asked_for(
    drive: Path, tmp_path: Path
) -> None:
    nondum("keys", "new", tmp_path / "alice").ok()
    told = nondum("payload", "check", drive, "--anywhere").ok().out
    assert told.startswith(f"{ID}: no one has signed it\n")
    nondum("payload", "sign", drive, "--key", tmp_path / "alice").ok()
    (key,) = nondum("payload", "check", drive, "--anywhere", "--json").ok().json["signers"][ID]
    assert key.startswith("SHA256:")
    told = nondum("payload", "check", drive, "--anywhere").ok().out
    assert told.startswith(f"{ID}: signed by {key}\n")


def test_another_kind_of_host_is_asked_about(tmp_path: Path) -> None:
    native = make_wheel(
        tmp_path, "native", "1.0", {"native.py": ""}, tag="cp312-cp312-linux_aarch64"
    )
    part = Part("blinker", "X = 1\n", wheels=(native,), with_sdk=False)
    make_payload(tmp_path / "drive", part)
    asked = ("payload", "verify", tmp_path / "drive", "--unsigned")
    nondum(*asked, "--arch", "aarch64", "--python", "3.12").ok()
    ran = nondum(*asked, "--arch", "x86_64", "--json")
    assert [row["code"] for row in ran.json["problems"]] == ["WHEEL_INCOMPATIBLE"]
    nondum(*asked, "--arch", "sparc").refused(2, "TARGET_UNKNOWN")


@pytest.fixture
def confined(tmp_path: Path) -> Path:
    """A drive whose payload asks for the highest level."""
    make_payload(tmp_path / "drive", PLAIN, requires='confinement = "sandboxed"')
    return tmp_path / "drive"


@pytest.mark.parametrize("verb", ["verify", "check"])
def test_the_host_that_runs_here_says_how_it_confines(
    tmp_path: Path, confined: Path, verb: str
) -> None:
    unsigned = ("--unsigned",) if verb == "verify" else ()
    at_none = '[workers]\nconfinement = "none"\n'
    with running(tmp_path / "host", more=at_none) as host:
        ran = host.run("payload", verb, confined, *unsigned, "--json")
        (problem,) = ran.json["problems"]
        assert (problem["code"], problem["have"]) == ("CONFINEMENT", "level none")
        host.run("payload", verb, confined, *unsigned, "--anywhere").ok()


def test_without_a_host_the_best_level_that_is_to_be_had_counts(confined: Path) -> None:
    levels = nondum("doctor", "confinement", "--json")
    available = {row["level"] for row in levels.json["levels"] if row["available"]}
    ran = nondum("payload", "check", confined, "--json")
    assert [row["code"] for row in ran.json["problems"]] == ["CONFINEMENT"] * (
        "sandboxed" not in available
    )


def test_hosts_of_another_kind_have_enough_of_everything(tmp_path: Path) -> None:
    greedy = "confinement = 3\nmemory_mb = 99999999\ngpu_memory_mb = 99999999"
    make_payload(tmp_path / "drive", PLAIN, requires=greedy)
    asked = ("payload", "verify", tmp_path / "drive", "--unsigned")
    nondum(*asked, "--arch", "aarch64", "--python", "3.12").ok()
    assert {row["code"] for row in nondum(*asked, "--json").json["problems"]} >= {
        "NO_MEMORY",
        "NO_GPU_MEMORY",
    }
