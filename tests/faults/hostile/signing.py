"""Signature files that are none, of strangers, for something else, or over other bytes.

The host goes by `TRUST`: every payload whose id begins with `org.hostile` is `MAKER`'s to sign.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

from tests.faults.hostile.case import Bench, HostileDrive
from tests.kit.signing import Key, armour, blob, trust_of

from nondum.wheelhouse.trust import sshsig, trust_text
from nondum.wheelhouse.trust.trust import Revocation

MAKER, LOST, STRANGER = Key("maker"), Key("lost"), Key("stranger")
OTHER, TOKEN = Key("other"), Key("token", fido=True)
ROOT = Key("root")
MADE = datetime(2026, 1, 1, tzinfo=UTC)

MALFORMED, UNTRUSTED, INVALID = "SIG_MALFORMED", "SIG_UNTRUSTED", "SIG_INVALID"
PURPOSE, TOO_LARGE = "SIG_WRONG_PURPOSE", "TOO_LARGE"


def trust() -> str:
    """The text of the trust file that the host goes by."""
    said = trust_of(
        roots=[ROOT],
        roles={
            "maker": (["org.hostile"], [MAKER, LOST]),
            "other": (["org.other"], [OTHER]),
            "healthy": (["org.example"], [MAKER]),
        },
        made=MADE,
    )
    revoked = (Revocation(LOST.public.fingerprint, "lost at sea"),)
    return trust_text.to_text(replace(said, revoked=revoked))


def sign(listed: bytes) -> bytes:
    """As the maker does."""
    return MAKER.sign(listed, sshsig.PAYLOAD)


def signed(name: str, code: str, signature: Callable[[bytes], bytes | None]) -> HostileDrive:
    """A sound payload with another signature file, made over its contents list."""

    def make(bench: Bench) -> None:
        bench.payload_files().write(bench.drive, signature)

    return HostileDrive(f"signature-{name}", code, make)


def as_fields(**fields: bytes) -> Callable[[bytes], bytes]:
    """A signature file with other fields than those of a good one."""

    def signature(listed: bytes) -> bytes:
        message = sshsig.to_be_signed(listed, sshsig.PAYLOAD, "sha512")
        good = {"key": MAKER.public.blob, "signature": _string(MAKER.secret.sign(message))}
        said = {**good, **fields}
        return armour(blob(**said))  # type: ignore[arg-type]  # the version is never among them

    return signature


def _string(signature: bytes) -> bytes:
    kind = b"ssh-ed25519"
    return b"".join(len(part).to_bytes(4, "big") + part for part in (kind, signature))


def flipped(listed: bytes) -> bytes:
    """Over the list with one bit of it changed."""
    return sign(bytes([listed[0] ^ 1]) + listed[1:])


DRIVES: tuple[HostileDrive, ...] = (
    signed("missing", "SIG_MISSING", lambda listed: None),
    signed("empty", MALFORMED, lambda listed: b""),
    signed("of-noise", MALFORMED, lambda listed: bytes(range(256)) * 8),
    signed("of-text", MALFORMED, lambda listed: b"trust me\n"),
    signed("cut", MALFORMED, lambda listed: sign(listed)[:-30]),
    signed("without-end", MALFORMED, lambda listed: sign(listed).rpartition(b"-----END")[0]),
    signed("of-four-megabytes", TOO_LARGE, lambda listed: b"x" * (4 * 2**20)),
    signed("a-byte-too-long", TOO_LARGE, lambda listed: sign(listed) + b"\n" * 8192),
    signed("with-text-behind", MALFORMED, lambda listed: sign(listed) + b"and me\n"),
    signed("not-base64", MALFORMED, lambda listed: sign(listed).replace(b"U1NIU", b"!!!!!")),
    signed("of-another-magic", MALFORMED, as_fields(magic=b"SSHXXX")),
    signed("without-key", MALFORMED, as_fields(key=b"")),
    signed("of-a-weak-key", MALFORMED, as_fields(key=_string(bytes(32)))),
    signed("of-another-hash", MALFORMED, as_fields(hash=b"md5")),
    signed("with-rest", MALFORMED, as_fields(rest=b"more")),
    signed("of-zeros", INVALID, as_fields(signature=_string(bytes(64)))),
    signed("over-another-list", INVALID, flipped),
    signed("over-nothing", INVALID, lambda listed: sign(b"")),
    signed("of-a-stranger", UNTRUSTED, lambda listed: STRANGER.sign(listed, sshsig.PAYLOAD)),
    signed("of-a-strange-token", UNTRUSTED, lambda listed: TOKEN.sign(listed, sshsig.PAYLOAD)),
    signed("of-a-root", UNTRUSTED, lambda listed: ROOT.sign(listed, sshsig.PAYLOAD)),
    signed("of-a-revoked-key", "SIG_REVOKED", lambda listed: LOST.sign(listed, sshsig.PAYLOAD)),
    signed("for-commits", PURPOSE, lambda listed: MAKER.sign(listed, "git")),
    signed("for-files", PURPOSE, lambda listed: MAKER.sign(listed, "file")),
    signed("for-trust-files", PURPOSE, lambda listed: MAKER.sign(listed, sshsig.TRUST)),
    signed(
        "by-who-owns-other-ids", "ID_OWNED_BY", lambda listed: OTHER.sign(listed, sshsig.PAYLOAD)
    ),
)
