"""What an owner may do to a trust file, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from tests.kit.signing import MADE, Key, trust_of

from nondum.sdk.errors import TrustRefused
from nondum.wheelhouse.trust import editing, owners_folder, sshsig, trust_file
from nondum.wheelhouse.trust.trust import Role, Trust

ALICE, BOB, CAROL = Key("alice"), Key("bob"), Key("carol")
TRUST = trust_of(roots=[ALICE], roles={"maker": (["org.example"], [BOB])})
ROLE = Role("lab", ("org.lab",), ("carol",))


@pytest.mark.parametrize(
    ("change", "code"),
    [
        pytest.param(
            lambda trust: editing.allowed(
                editing.revoked(trust, BOB.public, "lost"), BOB.trusted(), ROLE
            ),
            "KEY_REVOKED",
            id="a key that was revoked",
        ),
        pytest.param(
            lambda trust: editing.allowed(trust, replace(CAROL.trusted(), name="bob"), ROLE),
            "KEY_TAKEN",
            id="another key of that name",
        ),
        pytest.param(
            lambda trust: editing.allowed(trust, replace(BOB.trusted(), name="robert"), ROLE),
            "KEY_TAKEN",
            id="another name of that key",
        ),
        pytest.param(
            lambda trust: editing.revoked(trust, ALICE.public, "lost"),
            "ROOTS_TOO_FEW",
            id="the last root",
        ),
        pytest.param(
            lambda trust: editing.rotated(trust, "eve", CAROL.public, until=None),
            "KEY_UNKNOWN",
            id="no key to replace",
        ),
        pytest.param(
            lambda trust: editing.found(trust, "eve"), "KEY_UNKNOWN", id="no key of that name"
        ),
    ],
)
def test_what_an_owner_cannot_mean_is_refused(change: Callable[[Trust], object], code: str) -> None:
    with pytest.raises(TrustRefused) as refused:
        change(TRUST)
    assert refused.value.code == code
    assert refused.value.problems[0].fix


def test_keys_are_meant_by_name_or_fingerprint() -> None:
    stranger = CAROL.public.fingerprint
    assert editing.found(TRUST, "bob") == BOB.public
    assert editing.found(TRUST, stranger) == stranger
    assert editing.allowed(TRUST, CAROL.trusted(), ROLE).named(CAROL.public) == CAROL.trusted()


def test_a_trust_file_is_not_begun_where_one_is(tmp_path: Path) -> None:
    path = tmp_path / "trust.toml"
    owners_folder.create(path, TRUST)
    with pytest.raises(TrustRefused) as refused:
        owners_folder.create(path, replace(TRUST, owner="eve"))
    assert refused.value.code == "TRUST_EXISTS"
    assert owners_folder.parsed(path) == TRUST


def test_only_roots_sign_a_trust_file(tmp_path: Path) -> None:
    path = tmp_path / "trust.toml"
    owners_folder.create(path, TRUST)
    with pytest.raises(TrustRefused) as refused:
        owners_folder.sign(path, BOB.write(tmp_path))
    assert refused.value.code == "KEY_NOT_ROOT"
    assert owners_folder.read(path).signature is None
    owners_folder.sign(path, ALICE.write(tmp_path))
    assert owners_folder.still_missing(path) == ()


def test_files_that_are_too_long_are_not_read(tmp_path: Path) -> None:
    path = tmp_path / "trust.toml"
    owners_folder.create(path, TRUST)
    (tmp_path / "trust.toml.sig").write_bytes(b"\n" * (sshsig.MAX_BYTES + 1))
    with pytest.raises(TrustRefused) as refused:
        owners_folder.read(path)
    assert refused.value.code == "TOO_LARGE"
    (tmp_path / "trust.toml.sig").unlink()
    path.write_bytes(b"#" * (trust_file.MAX_BYTES + 1))
    with pytest.raises(TrustRefused) as refused:
        owners_folder.read(path)
    assert refused.value.code == "TOO_LARGE"


def test_an_edit_of_a_signed_version_is_the_next_one(tmp_path: Path) -> None:
    path = tmp_path / "trust.toml"
    owners_folder.create(path, TRUST)
    owners_folder.sign(path, ALICE.write(tmp_path))
    changed = owners_folder.edit(
        path, lambda trust: editing.revoked(trust, BOB.public, "lost"), MADE
    )
    assert changed.version == TRUST.version + 1
    assert [file.where for file in owners_folder.versions(path)] == [
        str(tmp_path / "trust-1.toml"),
        str(path),
    ]
