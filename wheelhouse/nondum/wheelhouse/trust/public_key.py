"""OpenSSH public keys: Ed25519, kept in a file (RFC 8709) or in a FIDO token (PROTOCOL.u2f)."""

from __future__ import annotations

import base64
import binascii
import hashlib
import re

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.trust.wire import Malformed, Reader, string

ED25519 = "ssh-ed25519"
FIDO = "sk-ssh-ed25519@openssh.com"
KINDS = (ED25519, FIDO)
KEY_BYTES = 32
FINGERPRINT = re.compile(r"SHA256:[A-Za-z0-9+/]{43}")
MAX_LINE = 1024

_FIELD = 2**255 - 19
_ORDER_8 = 0x05FC536D880238B13933C6D305ACDFD5F098EFF289F4C345B027B2C28F95E826
_WEAK = frozenset({0, 1, _FIELD - 1, _ORDER_8, _FIELD - _ORDER_8})
"""The y of the points of small order: under such a key some signatures hold for any text."""


class WrongKind(Malformed):
    """A key of another algorithm."""

    def __init__(self, kind: str) -> None:
        super().__init__(f"its key is a {kind[:40]!r}")
        self.kind = kind[:40]


@frozen
class PublicKey:
    """A key that signatures are checked with."""

    kind: str
    """One of `KINDS`."""
    point: bytes
    """The Ed25519 key, 32 bytes; it alone tells keys apart."""
    application: str = ""
    """What a FIDO token made the key for, `ssh:` unless its owner said otherwise."""

    @property
    def blob(self) -> bytes:
        """The key as SSH sends it."""
        blob = string(self.kind.encode("ascii")) + string(self.point)
        return blob + string(self.application.encode("ascii")) if self.kind == FIDO else blob

    @property
    def fingerprint(self) -> str:
        """What people compare: `SHA256:…`, as `ssh-keygen -l` prints it."""
        digest = hashlib.sha256(self.blob).digest()
        return "SHA256:" + base64.b64encode(digest).decode("ascii").rstrip("=")

    @property
    def line(self) -> str:
        """The key as it stands in a `.pub` file, without a comment."""
        return f"{self.kind} {base64.b64encode(self.blob).decode('ascii')}"


def parse_blob(data: bytes) -> PublicKey:
    """Read a key as SSH sends it. Raises `Malformed`, `WrongKind`."""
    reader = Reader(data)
    kind = reader.text()
    if kind not in KINDS:
        raise WrongKind(kind)
    point = reader.string()
    application = reader.text() if kind == FIDO else ""
    reader.end()
    if len(point) != KEY_BYTES:
        raise Malformed(f"its key has {len(point)} bytes, not {KEY_BYTES}")
    if _is_weak(point):
        raise Malformed("its key is one that anybody can sign for")
    return PublicKey(kind, point, application)


def parse_line(text: str) -> tuple[PublicKey, str]:
    """Read the line of a `.pub` file: the key, and the comment after it.

    Raises `Malformed`, `WrongKind`.
    """
    if len(text) > MAX_LINE:
        raise Malformed(f"it is longer than {MAX_LINE} characters")
    words = text.strip().split(None, 2)
    if len(words) < 2:
        raise Malformed("it is not a line like 'ssh-ed25519 AAAA… comment'")
    try:
        blob = base64.b64decode(words[1], validate=True)
    except (binascii.Error, ValueError) as error:
        raise Malformed("its second word is not base64") from error
    key = parse_blob(blob)
    if key.kind != words[0]:
        raise Malformed(f"it is called {words[0][:40]!r} and is a {key.kind}")
    return key, words[2] if len(words) > 2 else ""


def _is_weak(point: bytes) -> bool:
    return (int.from_bytes(point, "little") & (2**255 - 1)) % _FIELD in _WEAK
