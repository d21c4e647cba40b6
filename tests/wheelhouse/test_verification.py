"""Verification reports every problem of a payload, where a host stops at the first."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.payloads import Part, make_payload, make_wheel, seal
from tests.kit.signing import Key, sign_payload, trust_of
from tests.wheelhouse.hostile import WHEELS, HostileWheel
from tests.wheelhouse.hostile_wheels import WheelBuilder

from nondum.wheelhouse.build.verification import Verified, verify
from nondum.wheelhouse.format.confinement import Level
from nondum.wheelhouse.format.signatures import UnsignedAllowed, Verdict
from nondum.wheelhouse.format.target import Target, targets
from nondum.wheelhouse.payload import host_facts
from nondum.wheelhouse.trust.judging import Circumstances, Judging

ID = "org.example.test"
PLAIN = Part("blinker", "X = 1\n", with_sdk=False)
ALICE = Key("alice")
NO_TRUST = Judging(None, Circumstances())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_payload(tmp_path / "drive", PLAIN)


def codes(found: Verified) -> list[str]:
    return [problem.code for problem in found.problems]


def test_a_whole_payload_passes(folder: Path) -> None:
    found = verify(folder, UnsignedAllowed(), host_facts.of_target(Target("aarch64", "3.12")))
    assert (found.problems, found.signers) == ((), ())
    assert found.payload is not None and set(found.payload.index) == {"blinker"}


def test_a_folder_without_contents_list_is_told(tmp_path: Path) -> None:
    assert codes(verify(tmp_path, UnsignedAllowed())) == ["CONTENTS_MISSING"]


def test_an_unexpected_error_is_reported_for_that_payload(folder: Path) -> None:
    class Breaking(UnsignedAllowed):
        def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
            raise RuntimeError("unforeseen")

    found = verify(folder, Breaking())
    assert codes(found) == ["INTERNAL"]
    assert found.problems[0].where == folder.name


def test_missing_signatures_are_told_first(folder: Path) -> None:
    assert codes(verify(folder, NO_TRUST)) == ["SIG_MISSING"]


def test_signatures_that_are_none_are_told(folder: Path) -> None:
    (folder / "CONTENTS.sig").write_text("signed")
    assert codes(verify(folder, NO_TRUST)) == ["SIG_MALFORMED"]


def test_what_its_signer_may_not_grant_is_told(folder: Path) -> None:
    manifest = folder / "payload.toml"
    asking = 'permissions = ["network"]\ndistribution'
    manifest.write_text(manifest.read_text().replace("distribution", asking, 1))
    seal(folder, payload_id=ID)
    sign_payload(folder, ALICE)
    for permissions, told in (("network",), []), ((), ["PERMISSION_DENIED"]):
        roles = {"maker": ([ID], [ALICE])}
        trust = trust_of(roots=[ALICE], roles=roles, permissions=permissions)
        assert codes(verify(folder, Judging(trust, Circumstances()))) == told


def test_what_a_host_would_not_come_to_is_told_too(folder: Path) -> None:
    (folder / "payload.toml").write_text('id = "org.example.test"\nnmae = "x"\n')
    WheelBuilder(files={"evil/__init__.py": b"", "json.py": b"", "evil.pth": b""}).write(
        folder / "wheels"
    )
    seal(folder, payload_id=ID)
    found = verify(folder, NO_TRUST)
    assert {"SIG_MISSING", "MANIFEST_KEY", "WHEEL_SHADOWS", "WHEEL_STARTUP_HOOK"} <= set(
        codes(found)
    )
    assert codes(found)[0] == "SIG_MISSING"


def test_every_changed_file_is_told(folder: Path) -> None:
    for path in (folder / "payload.toml", folder / "index.json"):
        path.write_bytes(path.read_bytes() + b"\n")
    assert codes(verify(folder, NO_TRUST)) == ["SIG_MISSING", *["HASH_MISMATCH"] * 2]


def test_everything_is_told_once_and_with_what_to_do(tmp_path: Path) -> None:
    bad = WheelBuilder(files={"evil/__init__.py": b"", "json.py": b""}).write(tmp_path)
    folder = make_payload(tmp_path / "drive", Part("blinker", "X = 1\n", wheels=(bad,)))
    facts = host_facts.probe(tmp_path, reserve_mb=0, confinement=Level.NONE)
    found = verify(folder, UnsignedAllowed(), facts)
    assert codes(found) == ["WHEEL_SHADOWS"]
    assert all(problem.fix and problem.where for problem in found.problems)


def test_named_hosts_are_judged_by_their_own_tags(tmp_path: Path) -> None:
    tag = "cp312-cp312-linux_aarch64"
    native = make_wheel(tmp_path, "native", "1.0", {"native.py": ""}, tag=tag)
    folder = make_payload(
        tmp_path / "drive", Part("blinker", "X = 1\n", wheels=(native,), with_sdk=False)
    )
    for target in targets(("aarch64", "x86_64"), ("3.11", "3.12")):
        fits = target == Target("aarch64", "3.12")
        found = verify(folder, UnsignedAllowed(), host_facts.of_target(target))
        assert codes(found) == ([] if fits else ["WHEEL_INCOMPATIBLE"])


def test_wheels_that_exclude_the_python_are_told(tmp_path: Path) -> None:
    metadata = b"Metadata-Version: 2.1\nName: evil\nVersion: 1.0\nRequires-Python: <3.0\n"
    old = WheelBuilder(metadata=metadata).write(tmp_path)
    folder = make_payload(tmp_path / "drive", Part("blinker", "X = 1\n", wheels=(old,)))
    found = verify(folder, UnsignedAllowed(), host_facts.of_target(Target("x86_64", "3.11")))
    (problem,) = found.problems
    assert (problem.code, problem.need) == ("WHEEL_INCOMPATIBLE", "Python <3.0")


def test_hooks_that_the_signed_manifest_names_pass(tmp_path: Path) -> None:
    hooked = WheelBuilder(files={"evil/__init__.py": b"", "evil.pth": b"import evil\n"})
    part = Part("blinker", "X = 1\n", wheels=(hooked.write(tmp_path),))
    folder = make_payload(tmp_path / "drive", part)
    assert codes(verify(folder, UnsignedAllowed())) == ["WHEEL_STARTUP_HOOK"]
    manifest = folder / "payload.toml"
    manifest.write_text('startup_hooks = ["evil.pth"]\n' + manifest.read_text())
    seal(folder, payload_id=ID)
    assert codes(verify(folder, UnsignedAllowed())) == []


@pytest.mark.parametrize("hostile", WHEELS[::12], ids=lambda hostile: hostile.name)
def test_hostile_wheels_are_told_in_a_payload(tmp_path: Path, hostile: HostileWheel) -> None:
    """As one more file of an otherwise good payload."""
    folder = make_payload(tmp_path / "drive", PLAIN)
    (folder / "wheels" / hostile.filename).write_bytes(hostile.build(tmp_path / "canary"))
    seal(folder, payload_id=ID)
    assert set(codes(verify(folder, UnsignedAllowed()))) == {hostile.code}
    assert not (tmp_path / "canary").exists()
