"""A payload of goals only: a payload like any other, from signers that may give goals."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.payloads import seal
from tests.kit.signing import Key, sign_payload, trust_of

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.build import goal_payload
from nondum.wheelhouse.build.verification import Verified, verify
from nondum.wheelhouse.format import goals
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.signatures import UnsignedAllowed
from nondum.wheelhouse.payload import drive, host_facts
from nondum.wheelhouse.trust.judging import Circumstances, Judging

ALICE, ROOT, ID = Key("alice"), Key("root"), "org.example.delivery"


def judged(folder: Path, *permissions: str) -> Verified:
    roles = {"maker": (["org.example"], [ALICE])}
    trust = trust_of(roots=[ROOT], roles=roles, permissions=permissions)
    facts = host_facts.probe(folder, reserve_mb=0, confinement=Level.NONE)
    return verify(folder, Judging(trust, Circumstances()), facts)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return goal_payload.write(tmp_path / "drive", ID, ["follow me"], release=3)


def codes(found: Verified) -> list[str]:
    return [problem.code for problem in found.problems]


def test_it_is_found_on_its_drive_and_sound(folder: Path, tmp_path: Path) -> None:
    assert drive.find_payloads(tmp_path / "drive") == (folder,)
    found = verify(folder, UnsignedAllowed())
    assert found.problems == ()
    assert found.payload is not None
    assert (found.payload.goals, found.payload.contents.release) == (("follow me",), 3)


def test_it_is_taken_from_who_may_give_goals(folder: Path) -> None:
    sign_payload(folder, ALICE)
    assert codes(judged(folder, "goals")) == []
    assert codes(judged(folder, "*")) == []


def test_it_is_refused_from_who_may_not(folder: Path) -> None:
    sign_payload(folder, ALICE)
    assert codes(judged(folder, "network")) == ["PERMISSION_DENIED"]


def test_it_is_refused_unsigned(folder: Path) -> None:
    assert codes(judged(folder, "goals")) == ["SIG_MISSING"]


def test_another_takes_its_place(folder: Path, tmp_path: Path) -> None:
    assert goal_payload.write(tmp_path / "drive", ID, ["come back"]) == folder
    assert (folder / goals.NAME).read_text() == "come back\n"


@pytest.mark.parametrize("file", [goals.NAME, "payload.toml"])
def test_without_goals_it_is_nothing(folder: Path, file: str) -> None:
    (folder / file).unlink()
    seal(folder, payload_id=ID)
    assert codes(verify(folder, UnsignedAllowed())) in (["MANIFEST_KEY"], ["FILE_MISSING"])


def test_a_goal_file_that_is_too_long_is_not_even_copied(folder: Path) -> None:
    (folder / goals.NAME).write_text("#" * 2000)
    seal(folder, payload_id=ID)
    assert codes(verify(folder, UnsignedAllowed())) == ["TOO_LARGE"]


@pytest.mark.parametrize(("wanted", "id"), [([], ID), (["go\x00"], ID), (["go"], 'no id"\n')])
def test_what_hosts_would_refuse_is_not_written(tmp_path: Path, wanted: list[str], id: str) -> None:
    with pytest.raises(PayloadRefused):
        goal_payload.write(tmp_path / "drive", id, wanted)
    assert not (tmp_path / "drive").exists()
