"""`nondum lab`: runs a payload in the laboratory of a checkout, or says that there is none."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.command_line import nondum
from tests.kit.payloads import Part, make_payload

LAMP = "from nondum.sdk import hookimpl\n"
PROGRAM = '#!/bin/sh\nprintf "%s\\n" "$@"\n'


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    make_payload(tmp_path / "drive", Part("lamp", LAMP), payload_id="org.example.lamp")
    return tmp_path / "drive"


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Where nondum's sources would be; its program says what it was asked for."""
    folder = tmp_path / "sources"
    (folder / "tests/lab").mkdir(parents=True)
    (folder / "run").write_text(PROGRAM, encoding="utf-8")
    (folder / "run").chmod(0o755)
    return folder


def test_the_laboratory_of_the_named_checkout_is_run(drive: Path, checkout: Path) -> None:
    ran = nondum("lab", drive, "--arch", "aarch64", NONDUM_LAB=str(checkout)).ok()
    assert ran.out.split() == ["lab", "--arch", "aarch64", "--payload", str(drive), "payload"]


def test_a_payload_folder_of_a_drive_will_do(drive: Path, checkout: Path) -> None:
    folder = drive / "nondum/org.example.lamp"
    ran = nondum("lab", folder, "--keep", NONDUM_LAB=str(checkout)).ok()
    assert str(folder) in ran.out.split()
    assert "--keep" in ran.out.split()


def test_without_a_checkout_it_is_told_how_to_name_one(drive: Path, tmp_path: Path) -> None:
    nondum("lab", drive, NONDUM_LAB=str(tmp_path)).refused(2, "LAB_MISSING")


def test_a_folder_without_a_payload_is_no_drive(tmp_path: Path, checkout: Path) -> None:
    nondum("lab", tmp_path, NONDUM_LAB=str(checkout)).refused(1, "DRIVE_NOT_PAYLOAD")
