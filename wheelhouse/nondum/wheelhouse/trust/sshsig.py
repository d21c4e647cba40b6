"""Signatures of `ssh-keygen -Y sign` (PROTOCOL.sshsig), several in one file.

Every field is checked, and each signature has one form only: what is not as OpenSSH writes it is
refused. What checks the mathematics is loaded with the first signature.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
from collections.abc import Iterator

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.trust import public_key
from nondum.wheelhouse.trust.public_key import FIDO, PublicKey, WrongKind
from nondum.wheelhouse.trust.wire import Malformed, Reader, string

PAYLOAD = "nondum-payload@1"
"""Namespace of signatures over contents lists."""
TRUST = "nondum-trust@1"
"""Namespace of signatures over trust files."""

MAX_BYTES = 8 * 1024
MAX_SIGNATURES = 16
MAGIC = b"SSHSIG"
VERSION = 1
HASHES = ("sha256", "sha512")
BEGIN, END = "-----BEGIN SSH SIGNATURE-----", "-----END SSH SIGNATURE-----"
LINE = 70
"""Characters of base64 in a line, as ssh-keygen writes them."""

_USER_PRESENT = 0x01
_SIGNATURE_BYTES = 64


@frozen
class Signature:
    """One signature, well formed; whether it holds, `holds` says."""

    key: PublicKey
    namespace: str
    """What it was made for."""
    hash: str
    """One of `HASHES`."""
    signature: bytes
    """64 bytes (RFC 8032)."""
    flags: int = 0
    """What a FIDO token says of the person: bit 0, that one touched it."""
    counter: int = 0

    def holds(self, data: bytes) -> bool:
        """Whether the owner of the key has signed data."""
        from cryptography.exceptions import InvalidSignature
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

        if self.key.kind == FIDO and not self.flags & _USER_PRESENT:
            return False
        try:
            key = Ed25519PublicKey.from_public_bytes(self.key.point)
            key.verify(self.signature, self._signed(data))
        except (InvalidSignature, ValueError):
            return False
        return True

    def _signed(self, data: bytes) -> bytes:
        """The bytes that the key itself has signed."""
        message = to_be_signed(data, self.namespace, self.hash)
        if self.key.kind != FIDO:
            return message
        application = hashlib.sha256(self.key.application.encode("ascii")).digest()
        flags, counter = self.flags.to_bytes(1, "big"), self.counter.to_bytes(4, "big")
        return application + flags + counter + hashlib.sha256(message).digest()


def to_be_signed(data: bytes, namespace: str, hash: str) -> bytes:
    """The bytes that a key signs in the place of data."""
    digest = hashlib.new(hash, data).digest()
    parts = (namespace.encode("ascii"), b"", hash.encode("ascii"), digest)
    return MAGIC + b"".join(map(string, parts))


def armoured(key: PublicKey, namespace: str, hash: str, signature: bytes) -> bytes:
    """A signature, 64 bytes, by a key that is no FIDO token's, as ssh-keygen writes it."""
    inner = string(key.kind.encode("ascii")) + string(signature)
    parts = (key.blob, namespace.encode("ascii"), b"", hash.encode("ascii"), inner)
    blob = MAGIC + VERSION.to_bytes(4, "big") + b"".join(map(string, parts))
    text = base64.b64encode(blob).decode("ascii")
    lines = [text[start : start + LINE] for start in range(0, len(text), LINE)]
    return ("\n".join([BEGIN, *lines, END]) + "\n").encode("ascii")


def parse(data: bytes, where: str) -> tuple[Signature, ...]:
    """Read a signature file, at least one signature.

    Raises `PayloadRefused` (SIG_MALFORMED, SIG_WRONG_PURPOSE for a key of another algorithm).
    """
    try:
        if len(data) > MAX_BYTES:
            raise Malformed(f"it is longer than {MAX_BYTES} bytes")
        found = tuple(_signature(blob) for blob in _blobs(data))
        if not found:
            raise Malformed("there is no signature in it")
    except WrongKind as wrong:
        need = " or ".join(public_key.KINDS)
        told, fix = f"a signature is of no use: {wrong}", "sign with an Ed25519 key"
        raise PayloadRefused(
            Problem("SIG_WRONG_PURPOSE", told, where=where, need=need, have=wrong.kind, fix=fix)
        ) from wrong
    except Malformed as flaw:
        told, fix = f"is no signature file: {flaw}", "have it signed again: `nondum payload sign`"
        raise PayloadRefused(Problem("SIG_MALFORMED", told, where=where, fix=fix)) from flaw
    return found


def _blobs(data: bytes) -> Iterator[bytes]:
    """What stands between the markers, one after the other."""
    try:
        lines = data.decode("ascii").split("\n")
    except UnicodeDecodeError as error:
        raise Malformed(f"byte {error.start} is not ASCII") from error
    inside: list[str] | None = None
    count = 0
    for number, line in enumerate(lines, start=1):
        if inside is None:
            if line == BEGIN:
                inside = []
            elif line:
                raise Malformed(f"line {number} stands outside of a signature")
        elif line == END:
            count += 1
            if count > MAX_SIGNATURES:
                raise Malformed(f"there are more than {MAX_SIGNATURES} signatures in it")
            yield _decoded(inside)
            inside = None
        else:
            inside.append(line)
    if inside is not None:
        raise Malformed(f"it ends before {END!r}")


def _decoded(lines: list[str]) -> bytes:
    text = "".join(lines)
    try:
        data = base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError) as error:
        raise Malformed("a signature is not base64") from error
    if base64.b64encode(data).decode("ascii") != text:
        raise Malformed("a signature has bits left over in its base64")
    return data


def _signature(blob: bytes) -> Signature:
    """One signature, every field of it checked. Raises `Malformed`, `WrongKind`."""
    reader = Reader(blob)
    if reader.take(len(MAGIC)) != MAGIC:
        raise Malformed("it does not begin with SSHSIG")
    if (version := reader.uint32()) != VERSION:
        raise Malformed(f"it is of version {version}, not {VERSION}")
    key = public_key.parse_blob(reader.string())
    namespace = reader.text()
    if reader.string():
        raise Malformed("its reserved field is not empty")
    if (hash := reader.text()) not in HASHES:
        raise Malformed(f"its hash is {hash[:40]!r}, not one of {', '.join(HASHES)}")
    inner = Reader(reader.string())
    reader.end()
    if (kind := inner.text()) != key.kind:
        raise Malformed(f"its key is a {key.kind}, and it was made with a {kind[:40]!r}")
    signature = inner.string()
    if len(signature) != _SIGNATURE_BYTES:
        raise Malformed(f"it has {len(signature)} bytes, not {_SIGNATURE_BYTES}")
    is_fido = key.kind == FIDO
    flags = inner.take(1)[0] if is_fido else 0
    counter = inner.uint32() if is_fido else 0
    inner.end()
    return Signature(key, namespace, hash, signature, flags, counter)
