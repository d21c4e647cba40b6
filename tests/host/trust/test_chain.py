"""The trust files on a host's disk, as child processes follow and use them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.kit.golden import Golden
from tests.kit.lamp_drive import lamp, told
from tests.kit.signing import Key, sign_payload, signed, trust_of

from nondum.host.trust import chain
from nondum.host.trust.anchors import Origin
from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.format import manifest
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


def test_chain_begins_with_the_first_file_and_says_who_vouches_for_it(anchor: Path) -> None:
    said = load(anchor)
    assert (said["text"], codes(said)) == (TEXT, [])
    assert said["origin"] == (Origin.ROOT if os.geteuid() == 0 else Origin.USER).value
    (anchor.parent / "trust.toml.sig").write_bytes(signed(TRUST, ROOT).signature or b"")
    assert load(anchor)["origin"] == Origin.SIGNED.value


def test_chain_does_not_begin_with_a_file_that_is_signed_falsely(anchor: Path) -> None:
    (anchor.parent / "trust.toml.sig").write_bytes(signed(TRUST, BOB).signature or b"")
    said = load(anchor)
    assert (said["text"], said["origin"], codes(said)) == (None, "", ["TRUST_SIGNATURE"])


@pytest.mark.parametrize(
    ("suffix", "size"), [("", trust_file.MAX_BYTES), (".sig", sshsig.MAX_BYTES)]
)
def test_kept_file_that_is_too_long_is_not_parsed(
    anchor: Path, suffix: str, size: int, golden: Golden
) -> None:
    """A file that long was replaced on purpose."""
    kept = anchor.parent / "kept"
    kept.mkdir()
    following = signed(replace(TRUST, version=2), ROOT)
    (kept / "00000002.toml").write_bytes(following.data)
    (kept / "00000002.toml.sig").write_bytes(following.signature or b"")
    path = kept / f"00000002.toml{suffix}"
    path.write_bytes(b"\n" * (size + 1) + path.read_bytes())
    said = load(anchor)
    assert (said["text"], codes(said)) == (TEXT, ["TOO_LARGE"])
    golden.check("a kept trust file is too large", said["problems"][0]["fix"])


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
