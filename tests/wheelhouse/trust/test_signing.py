"""Making keys and signatures: what is refused, with ssh-keygen and without it."""

from __future__ import annotations

from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from tests.kit.signing import Key

from nondum.sdk.errors import TrustRefused
from nondum.wheelhouse.trust import signing
from nondum.wheelhouse.trust.sshsig import PAYLOAD

ALICE = Key("alice")


@pytest.fixture
def without_ssh_keygen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")


def code(refused: pytest.ExceptionInfo[TrustRefused]) -> str:
    assert refused.value.problems[0].fix
    return refused.value.code


@pytest.mark.parametrize("there", ["key", "key.pub"])
def test_a_key_is_never_overwritten(tmp_path: Path, there: str) -> None:
    (tmp_path / there).write_text("precious")
    with pytest.raises(TrustRefused) as refused:
        signing.make_key(tmp_path / "key", "", fido=False, passphrase=False)
    assert code(refused) == "KEY_EXISTS"
    assert (tmp_path / there).read_text() == "precious"
    assert [path.name for path in tmp_path.iterdir()] == [there]


def test_lines_that_are_no_keys_are_refused() -> None:
    with pytest.raises(TrustRefused) as refused:
        signing.parse_public("ssh-ed25519 !!", "key.pub")
    assert code(refused) == "KEY_MALFORMED"


def test_what_ssh_keygen_refuses_is_refused(tmp_path: Path) -> None:
    (tmp_path / "key").write_text("hello")
    with pytest.raises(TrustRefused) as refused:
        signing.sign(b"data", tmp_path / "key", PAYLOAD)
    assert code(refused) == "SSH_KEYGEN"


@pytest.mark.usefixtures("without_ssh_keygen")
def test_keys_in_tokens_need_ssh_keygen(tmp_path: Path) -> None:
    with pytest.raises(TrustRefused) as refused:
        signing.make_key(tmp_path / "key", "", fido=True, passphrase=False)
    assert code(refused) == "SSH_KEYGEN"


@pytest.mark.usefixtures("without_ssh_keygen")
def test_files_that_are_no_keys_sign_nothing(tmp_path: Path) -> None:
    (tmp_path / "key").write_text("hello")
    with pytest.raises(TrustRefused) as refused:
        signing.sign(b"data", tmp_path / "key", PAYLOAD)
    assert code(refused) == "KEY_MALFORMED"


@pytest.mark.usefixtures("without_ssh_keygen")
def test_keys_of_other_algorithms_sign_nothing(tmp_path: Path) -> None:
    other = generate_private_key(SECP256R1()).private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.OpenSSH,
        serialization.NoEncryption(),
    )
    (tmp_path / "key").write_bytes(other)
    with pytest.raises(TrustRefused) as refused:
        signing.sign(b"data", tmp_path / "key", PAYLOAD)
    assert code(refused) == "KEY_MALFORMED"


@pytest.mark.usefixtures("without_ssh_keygen")
def test_keys_made_without_ssh_keygen_sign(tmp_path: Path) -> None:
    made = signing.make_key(tmp_path / "key", "me", fido=False, passphrase=False)
    assert signing.read_public(tmp_path / "key") == made
    assert signing.sign(b"data", tmp_path / "key", PAYLOAD).startswith(b"-----BEGIN SSH")
