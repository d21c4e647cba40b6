"""Signatures of ssh-keygen: the real ones hold, and nothing else does."""

from __future__ import annotations

import base64
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.signing import Key, armour, blob

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse.trust import signing, sshsig
from nondum.wheelhouse.trust.public_key import ED25519, FIDO, PublicKey
from nondum.wheelhouse.trust.sshsig import PAYLOAD
from nondum.wheelhouse.trust.wire import string

ALICE, BOB, TOKEN = Key("alice"), Key("bob"), Key("token", fido=True)
DATA = b"nondum-payload 1\n"
SIGNED = ALICE.sign(DATA, PAYLOAD)
INNER = string(ED25519.encode()) + string(bytes(64))


def refusal(data: bytes) -> str:
    with pytest.raises(PayloadRefused) as refused:
        sshsig.parse(data, "CONTENTS.sig")
    (problem,) = refused.value.problems
    assert problem.fix
    return problem.code


def test_what_ssh_keygen_signs_holds(tmp_path: Path) -> None:
    key = tmp_path / "key"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key)], check=True)
    command = ["ssh-keygen", "-Y", "sign", "-q", "-n", PAYLOAD, "-f", str(key)]
    made = subprocess.run(command, input=DATA, capture_output=True, check=True).stdout
    (found,) = sshsig.parse(made, "CONTENTS.sig")
    assert found.namespace == PAYLOAD
    assert found.holds(DATA)
    assert not found.holds(DATA + b"\n")
    listed = subprocess.run(["ssh-keygen", "-lf", key], capture_output=True, check=True, text=True)
    assert found.key.fingerprint == listed.stdout.split()[1]
    assert signing.read_public(key) == found.key


@pytest.mark.parametrize("key", [ALICE, TOKEN], ids=["file", "fido"])
@pytest.mark.parametrize("hash", sshsig.HASHES)
def test_ssh_keygen_believes_what_the_tests_sign(tmp_path: Path, key: Key, hash: str) -> None:
    """So that what is shown of FIDO tokens here, without one, is shown of real ones."""
    (tmp_path / "allowed").write_text(f"who {key.public.line}\n")
    (tmp_path / "signature").write_bytes(key.sign(DATA, PAYLOAD, hash))
    command = [
        *("ssh-keygen", "-Y", "verify", "-n", PAYLOAD, "-I", "who"),
        *("-f", str(tmp_path / "allowed"), "-s", str(tmp_path / "signature")),
    ]
    subprocess.run(command, input=DATA, check=True, capture_output=True)
    (found,) = sshsig.parse(key.sign(DATA, PAYLOAD, hash), "CONTENTS.sig")
    assert found.key == key.public
    assert found.holds(DATA)


def test_a_signature_without_touch_of_the_token_is_refused() -> None:
    (found,) = sshsig.parse(TOKEN.sign(DATA, PAYLOAD, flags=0), "")
    assert not found.holds(DATA)


def test_a_token_that_was_made_for_something_else_is_another_key() -> None:
    (found,) = sshsig.parse(TOKEN.sign(DATA, PAYLOAD), "")
    other = PublicKey(FIDO, found.key.point, "ssh:other")
    assert other != found.key
    assert other.fingerprint != found.key.fingerprint


def test_several_signatures_stand_in_one_file() -> None:
    found = sshsig.parse(SIGNED + b"\n" + TOKEN.sign(DATA, PAYLOAD), "")
    assert [one.key for one in found] == [ALICE.public, TOKEN.public]
    assert all(one.holds(DATA) for one in found)


def test_signing_without_ssh_keygen_makes_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = ALICE.write(tmp_path)
    with_it = signing.sign(DATA, key, PAYLOAD)
    monkeypatch.setenv("PATH", "")
    assert signing.sign(DATA, key, PAYLOAD) == with_it == SIGNED


def test_a_second_signature_of_one_key_takes_the_place_of_the_first() -> None:
    old, other = ALICE.sign(b"old", PAYLOAD), BOB.sign(DATA, PAYLOAD)
    assert signing.added(None, SIGNED, "") == SIGNED
    assert signing.added(old + other, SIGNED, "") == other + SIGNED


FIELDS = {
    "magic": blob(magic=b"SSHSIK", key=ALICE.public.blob, signature=INNER),
    "version": blob(version=2, key=ALICE.public.blob, signature=INNER),
    "reserved": blob(reserved=b"x", key=ALICE.public.blob, signature=INNER),
    "hash": blob(hash=b"md5", key=ALICE.public.blob, signature=INNER),
    "namespace": blob(namespace=b"a\xff", key=ALICE.public.blob, signature=INNER),
    "more after it": blob(key=ALICE.public.blob, signature=INNER, rest=b"x"),
    "more in it": blob(key=ALICE.public.blob, signature=INNER + b"x"),
    "another algorithm": blob(
        key=ALICE.public.blob, signature=string(FIDO.encode()) + string(bytes(64)) + bytes(5)
    ),
    "short signature": blob(
        key=ALICE.public.blob, signature=string(ED25519.encode()) + string(bytes(63))
    ),
    "long name": blob(namespace=b"a" * 4097, key=ALICE.public.blob, signature=INNER),
    "more in its key": blob(key=ALICE.public.blob + b"x", signature=INNER),
    "short key": blob(key=ALICE.public.blob[:-1], signature=INNER),
    "key of 31 bytes": blob(
        key=string(ED25519.encode()) + string(bytes(range(31))), signature=INNER
    ),
    "weak key": blob(
        key=string(ED25519.encode()) + string((1).to_bytes(32, "little")), signature=INNER
    ),
    "lying length": blob(key=ALICE.public.blob, signature=INNER)[:-80] + b"\xff\xff\xff\xff",
    "nothing": b"",
}


@pytest.mark.parametrize("data", FIELDS.values(), ids=FIELDS)
def test_every_field_is_checked(data: bytes) -> None:
    assert refusal(armour(data)) == "SIG_MALFORMED"


@pytest.mark.parametrize("kind", ["ssh-rsa", "ecdsa-sha2-nistp256", "ssh-ed448"])
def test_keys_of_other_algorithms_are_of_no_use(kind: str) -> None:
    data = blob(key=string(kind.encode()) + string(b"\x01"), signature=INNER)
    assert refusal(armour(data)) == "SIG_WRONG_PURPOSE"


TEXT = SIGNED.decode()
FILES = {
    "empty": "",
    "blank": "\n\n",
    "words before": "hello\n" + TEXT,
    "words after": TEXT + "hello\n",
    "no end": TEXT.replace(sshsig.END, ""),
    "no begin": TEXT.replace(sshsig.BEGIN, ""),
    "two begins": TEXT.replace(sshsig.BEGIN, f"{sshsig.BEGIN}\n{sshsig.BEGIN}"),
    "other line ends": TEXT.replace("\n", "\r\n"),
    "no base64": TEXT.replace("U1NIU0lH", "U1NI*0lH"),
    "spaces": TEXT.replace("U1NIU0lH", "U1NI U0lH"),
    "not ASCII": TEXT + "é",
    "too many": TEXT * 17,
    "a second one without end": TEXT + TEXT.replace(sshsig.END, ""),
    "too long": TEXT + "\n" * sshsig.MAX_BYTES,
}


@pytest.mark.parametrize("text", FILES.values(), ids=FILES)
def test_what_is_no_signature_file_is_malformed(text: str) -> None:
    assert refusal(text.encode()) == "SIG_MALFORMED"


def test_base64_has_one_form_only() -> None:
    """Else two files would be one signature: the last character has bits that no parser reads."""
    body = blob(key=ALICE.public.blob, namespace=b"of-some-length", signature=INNER)
    text = base64.b64encode(body).decode()
    assert text.endswith("==")
    assert sshsig.parse(armour(body), "")
    other = text[:-3] + chr(ord(text[-3]) + 1) + "=="
    assert base64.b64decode(other) == body
    assert refusal(f"{sshsig.BEGIN}\n{other}\n{sshsig.END}\n".encode()) == "SIG_MALFORMED"


def test_no_byte_of_a_signature_can_be_changed() -> None:
    for original in (SIGNED, TOKEN.sign(DATA, PAYLOAD)):
        text = original.decode().splitlines()
        body = base64.b64decode("".join(text[1:-1]))
        for place in range(len(body)):
            changed = body[:place] + bytes([body[place] ^ 1]) + body[place + 1 :]
            try:
                (found,) = sshsig.parse(armour(changed), "")
            except PayloadRefused:
                continue
            assert not (found.holds(DATA) and found.namespace == PAYLOAD)


@given(st.binary(max_size=400))
def test_noise_is_refused_and_nothing_else_raised(noise: bytes) -> None:
    for data in (noise, armour(noise), armour(b"SSHSIG" + noise)):
        try:
            sshsig.parse(data, "CONTENTS.sig")
        except PayloadRefused as refused:
            assert refused.code in ("SIG_MALFORMED", "SIG_WRONG_PURPOSE")


@given(
    st.fixed_dictionaries(
        {
            "key": st.sampled_from([ALICE.public.blob, TOKEN.public.blob]) | st.binary(max_size=80),
            "namespace": st.binary(max_size=40),
            "hash": st.sampled_from([b"sha256", b"sha512", b"md5"]),
            "signature": st.just(INNER) | st.binary(max_size=120),
            "reserved": st.sampled_from([b"", b"x"]),
        }
    )
)
def test_well_formed_lies_do_not_hold(fields: dict[str, bytes]) -> None:
    try:
        (found,) = sshsig.parse(armour(blob(**fields)), "CONTENTS.sig")  # type: ignore[arg-type]  # all are bytes
    except PayloadRefused:
        return
    assert not found.holds(DATA)
