"""Who has signed a payload, and who may: signatures and trust files."""

from __future__ import annotations

import base64

from tests.fuzz.target import Target, of_text
from tests.fuzz.tokens import TOML

from nondum.wheelhouse.trust import sshsig, trust_file
from nondum.wheelhouse.trust.public_key import FIDO, PublicKey
from nondum.wheelhouse.trust.wire import string

WHERE = "fuzzed"

TOUCHED = b"\1\0\0\0\7"
"""What a FIDO token adds to a signature: that a person was there, and its counter."""


def _public_key() -> PublicKey:
    point = base64.b64decode("R0UdCfPvbzM/XVCmWYsjLAMTvOZ5YVsjSEzg1q3PxQE=")
    return PublicKey("ssh-ed25519", point)


def _bare_signatures() -> list[bytes]:
    """What stands between the markers, for a key in a file and one in a token."""
    return [_bare(_public_key(), b""), _bare(PublicKey(FIDO, _public_key().point, "ssh:"), TOUCHED)]


def _bare(key: PublicKey, more: bytes) -> bytes:
    inner = string(key.kind.encode()) + string(bytes(range(64))) + more
    parts = (key.blob, sshsig.PAYLOAD.encode(), b"", b"sha512", inner)
    return sshsig.MAGIC + b"\0\0\0\1" + b"".join(map(string, parts))


def _read_bare_signature(data: bytes) -> object:
    """Armoured as it must be, so that what is inside is what is judged."""
    text = base64.b64encode(data).decode()
    lines = [text[at : at + sshsig.LINE] for at in range(0, len(text), sshsig.LINE)]
    return _read_signature("\n".join([sshsig.BEGIN, *lines, sshsig.END, ""]).encode())


def _signatures() -> list[bytes]:
    one = sshsig.armoured(_public_key(), sshsig.PAYLOAD, "sha512", bytes(range(64)))
    return [one, one + one]


def _read_signature(data: bytes) -> object:
    return [signature.holds(b"contents") for signature in sshsig.parse(data, WHERE)]


def _trust_files() -> list[bytes]:
    key = f"ssh-ed25519 {base64.b64encode(_public_key().blob).decode()}"
    return [
        f"""\
format = "nondum-trust 1"
owner = "survey"
version = 3
made = "2026-08-01T00:00:00Z"
fleets = ["survey"]

[roots]
threshold = 1
[[roots.key]]
name = "alice"
key = "{key}"

[[key]]
name = "acme-release"
key = "{key}"
until = "2028-01-01T00:00:00Z"

[[role]]
name = "acme"
payloads = ["com.acme"]
keys = ["acme-release"]
permissions = ["network"]

[[revoked]]
fingerprint = "SHA256:{"a" * 43}"
why = "lost"
""".encode()
    ]


TARGETS = (
    Target(
        "signature",
        _read_signature,
        _signatures,
        tokens=(sshsig.BEGIN.encode(), sshsig.END.encode(), b"U1NIU0lH", b"\n"),
        cases=1_000_000,
    ),
    Target(
        "signature, bare",
        _read_bare_signature,
        _bare_signatures,
        tokens=(b"SSHSIG", b"\0\0\0\1", b"sha512", b"ssh:", b"sk-ssh-ed25519@openssh.com"),
        cases=1_000_000,
    ),
    Target("trust file", of_text(lambda t: trust_file.parse(t, WHERE)), _trust_files, tokens=TOML),
)
