"""The trust files on a host's disk, as child processes follow and use them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.kit.lamp_drive import lamp, told
from tests.kit.signing import Key, sign_payload, signed, trust_of

from nondum.host.trust import chain
from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse import manifest
from nondum.wheelhouse.trust import sshsig, trust_file, trust_text

ROOT, ALICE, BOB = Key("root"), Key("alice"), Key("bob")
TRUST = trust_of(roots=[ROOT], roles={"maker": (["org.example"], [ALICE])})
TEXT = trust_text.to_text(TRUST)


@pytest.fixture
def anchor(tmp_path: Path) -> Path:
    path = tmp_path / "trust.toml"
    path.write_text(TEXT)
    path.chmod(0o644)
    return path


def load(anchor: Path) -> dict[str, Any]:
    return chain.load({"folder": str(anchor.parent / "kept"), "anchor": str(anchor)}, told)


def codes(said: dict[str, Any]) -> list[str]:
    return [problem["code"] for problem in said["problems"]]


def test_file_that_root_wrote_is_believed(anchor: Path) -> None:
    said = load(anchor)
    assert (said["text"], codes(said)) == (TEXT, [])


@pytest.mark.parametrize("mode", [0o664, 0o646])
def test_file_that_others_can_write_to_is_not_believed(anchor: Path, mode: int) -> None:
    anchor.chmod(mode)
    said = load(anchor)
    assert (said["text"], codes(said)) == (None, ["TRUST_OPEN_TO_OTHERS"])


@pytest.mark.skipif(os.geteuid() != 0, reason="giving files away needs root")
def test_file_of_another_user_is_not_believed(anchor: Path) -> None:
    os.chown(anchor, 65534, -1)
    said = load(anchor)
    assert (said["text"], codes(said)) == (None, ["TRUST_OPEN_TO_OTHERS"])


@pytest.mark.parametrize(
    ("suffix", "size"), [("", trust_file.MAX_BYTES), (".sig", sshsig.MAX_BYTES)]
)
def test_file_that_is_too_long_is_not_parsed(anchor: Path, suffix: str, size: int) -> None:
    """Whoever replaced it has done so on purpose."""
    path = anchor.with_name(anchor.name + suffix)
    path.write_bytes(b"\n" * (size + 1) + (path.read_bytes() if path.exists() else b""))
    said = load(anchor)
    assert (said["text"], codes(said)) == (None, ["TOO_LARGE"])
    assert said["problems"][0]["fix"] == "put the genuine file there"


def test_next_version_is_kept_and_followed_only_if_its_roots_signed_it(
    anchor: Path, tmp_path: Path
) -> None:
    given = {"folder": str(tmp_path / "kept"), "known": load(anchor)["known"], "trust": TEXT}
    following = replace(TRUST, version=2, fleets=("survey",))
    said = chain.extend({**given, "offered": chain.packed((signed(following, ALICE),))}, told)
    assert (said["taken"], codes(said)) == ([], ["TRUST_SIGNATURE"])
    said = chain.extend({**given, "offered": chain.packed((signed(following, ROOT),))}, told)
    assert (said["taken"], codes(said)) == ([2], [])
    assert load(anchor)["text"] == trust_text.to_text(following)
    (tmp_path / "kept/00000002.toml").write_text(trust_text.to_text(replace(TRUST, version=2)))
    said = load(anchor)
    assert (said["text"], codes(said)) == (TEXT, ["TRUST_SIGNATURE"])


def test_what_is_kept_of_a_payload_is_judged_again(tmp_path: Path) -> None:
    folder = lamp(tmp_path / "drive")
    asked = manifest.parse((folder / "payload.toml").read_text(), manifest.NAME)
    rules = {"host": "", "allow_unsigned": False, "trust": TEXT}
    sign_payload(folder, BOB)
    with pytest.raises(PayloadRefused) as refused:
        chain.grant_of_kept(rules, folder, asked)
    assert refused.value.code == "SIG_UNTRUSTED"
    assert chain.grant_of_kept({**rules, "demand_trust": False}, folder, asked).role == ""
    sign_payload(folder, ALICE)
    assert chain.grant_of_kept(rules, folder, asked).role == "maker"
    greedy = replace(asked, components=(replace(asked.components[0], permissions=("network",)),))
    with pytest.raises(PayloadRefused) as refused:
        chain.grant_of_kept(rules, folder, greedy)
    assert refused.value.code == "PERMISSION_DENIED"
