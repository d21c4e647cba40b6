"""Keys, signatures and trust files for tests: a key is its name, and always the same.

ALICE = Key("alice")
ALICE.sign(data, sshsig.PAYLOAD)
trust_of(roots=[ALICE], roles={"maker": (["org.example"], [ALICE])})
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from nondum.wheelhouse.trust import sshsig, trust_text
from nondum.wheelhouse.trust.public_key import ED25519, FIDO, PublicKey
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Role, Roots, Trust, TrustedKey
from nondum.wheelhouse.trust.wire import string

MADE = datetime(2026, 8, 1, tzinfo=UTC)
NOW = datetime(2026, 9, 1, tzinfo=UTC)
TOUCHED = 0x01


@dataclass(frozen=True)
class Key:
    """Somebody's key pair, in a file or (`fido`) in a token."""

    name: str
    fido: bool = False

    @property
    def secret(self) -> Ed25519PrivateKey:
        return Ed25519PrivateKey.from_private_bytes(hashlib.sha256(self.name.encode()).digest())

    @property
    def public(self) -> PublicKey:
        point = self.secret.public_key().public_bytes_raw()
        return PublicKey(FIDO, point, "ssh:") if self.fido else PublicKey(ED25519, point)

    def trusted(self, since: datetime | None = None, until: datetime | None = None) -> TrustedKey:
        return TrustedKey(self.name, self.public, since, until)

    def sign(
        self, data: bytes, namespace: str, hash: str = "sha512", *, flags: int = TOUCHED
    ) -> bytes:
        """As ssh-keygen does: a whole signature file."""
        message = sshsig.to_be_signed(data, namespace, hash)
        if not self.fido:
            return sshsig.armoured(self.public, namespace, hash, self.secret.sign(message))
        said = bytes([flags]) + (7).to_bytes(4, "big")
        application, digest = hashlib.sha256(b"ssh:").digest(), hashlib.sha256(message).digest()
        signature = self.secret.sign(application + said + digest)
        return armour(
            blob(
                key=self.public.blob,
                namespace=namespace.encode(),
                hash=hash.encode(),
                signature=string(FIDO.encode()) + string(signature) + said,
            )
        )

    def write(self, folder: Path) -> Path:
        """A key file as ssh-keygen makes them, and its `.pub` beside it."""
        path = folder / self.name
        text = self.secret.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.OpenSSH,
            serialization.NoEncryption(),
        )
        path.write_bytes(text)
        path.chmod(0o600)
        path.with_name(f"{self.name}.pub").write_text(f"{self.public.line} {self.name}\n")
        return path


def blob(
    *,
    magic: bytes = b"SSHSIG",
    version: int = 1,
    key: bytes,
    namespace: bytes = sshsig.PAYLOAD.encode(),
    reserved: bytes = b"",
    hash: bytes = b"sha512",
    signature: bytes,
    rest: bytes = b"",
) -> bytes:
    """The bytes within a signature file, each field as it is given (PROTOCOL.sshsig)."""
    parts = (key, namespace, reserved, hash, signature)
    return magic + version.to_bytes(4, "big") + b"".join(map(string, parts)) + rest


def armour(data: bytes) -> bytes:
    """Bytes as a signature file holds them."""
    text = base64.b64encode(data).decode()
    lines = [text[start : start + sshsig.LINE] for start in range(0, len(text), sshsig.LINE)]
    return "\n".join([sshsig.BEGIN, *lines, sshsig.END, ""]).encode()


def trust_of(
    *,
    roots: Sequence[Key],
    root_threshold: int = 1,
    roles: Mapping[str, tuple[Sequence[str], Sequence[Key]]] | None = None,
    permissions: Sequence[str] = (),
    threshold: int = 1,
    version: int = 1,
    made: datetime = MADE,
    fleets: Sequence[str] = (),
) -> Trust:
    """A trust file's value. `roles`: name → beginnings of ids, and keys."""
    said = roles or {}
    keys = dict.fromkeys(key for _, group in said.values() for key in group)
    return Trust(
        owner="survey",
        version=version,
        made=made,
        roots=Roots(tuple(root.trusted() for root in roots), root_threshold),
        fleets=tuple(fleets),
        keys=tuple(key.trusted() for key in keys),
        roles=tuple(
            Role(name, tuple(ids), tuple(k.name for k in group), threshold, tuple(permissions))
            for name, (ids, group) in said.items()
        ),
    )


def signed(trust: Trust | str, *signers: Key, namespace: str = sshsig.TRUST) -> SignedFile:
    """A trust file, signed with some keys; none: without a signature file."""
    data = (trust if isinstance(trust, str) else trust_text.to_text(trust)).encode()
    signatures = b"".join(key.sign(data, namespace) for key in signers)
    return SignedFile(data, signatures or None)


def sign_payload(folder: Path, *signers: Key) -> None:
    """Put the signatures of some beside a contents list."""
    data = (folder / "CONTENTS").read_bytes()
    signatures = b"".join(key.sign(data, sshsig.PAYLOAD) for key in signers)
    (folder / "CONTENTS.sig").write_bytes(signatures)
