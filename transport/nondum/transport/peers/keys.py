"""A host's long-term CURVE key pair: who it is, to its peers. Source: RFC 26/CurveZMQ, RFC 32/Z85.

The file has one line, `nondum-host-key@1 PUBLIC SECRET`, both in Z85.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
from dataclasses import field
from pathlib import Path
from typing import NewType

import zmq
from zmq.utils import z85

from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers import private_file
from nondum.transport.peers.failures import PeerRefused

PeerKey = NewType("PeerKey", str)
"""A host's public CURVE key in Z85, 40 characters: its identity."""

_HEADER = "nondum-host-key@1"


@frozen
class HostKeys:
    """A key pair. The secret is not shown by `repr`."""

    public: PeerKey
    secret: str = field(repr=False)
    """In Z85."""

    @classmethod
    def generate(cls) -> HostKeys:
        """Make a fresh pair. Its public key does not look like an option where people type it."""
        public = b"-"
        while public.startswith(b"-"):  # a letter of Z85: one key of 85 would
            public, secret = zmq.curve_keypair()
        return cls(PeerKey(public.decode("ascii")), secret.decode("ascii"))


def parse_key(text: str) -> PeerKey:
    """Read a public key. Raises `PeerRefused` (KEY_MALFORMED).

    >>> parse_key("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7")
    'rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7'
    """
    try:
        if len(text) != 40:
            raise ValueError("it has another length")
        known = z85.encode(z85.decode(text)).decode("ascii")
    except Exception as error:  # z85 raises KeyError, struct.error, ValueError …
        raise PeerRefused(_malformed(text)) from error
    if known != text:  # one text a key: otherwise a revoked key could come back in another one
        raise PeerRefused(_malformed(text))
    return PeerKey(text)


def fingerprint(key: str) -> str:
    """A key for people, a host's or a fleet's: 100 bits of its SHA-256, in base32.

    >>> fingerprint(PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7"))
    'QQIS-PBOR-BEVH-576C-LECF'
    """
    digest = hashlib.sha256(key.encode("ascii")).digest()
    text = base64.b32encode(digest).decode("ascii")[:20]
    return "-".join(text[i : i + 4] for i in range(0, 20, 4))


def load_or_create(path: Path) -> HostKeys:
    """The pair kept in a file, made there at the first start.

    Raises `PeerRefused` (FILE_OPEN_TO_OTHERS, FILE_MALFORMED, KEY_MALFORMED), `OSError`.
    """
    if not path.exists():
        pair = HostKeys.generate()
        with contextlib.suppress(FileExistsError):  # another start was quicker: take its pair
            private_file.create(path, f"{_HEADER} {pair.public} {pair.secret}\n")
    return _parse(private_file.read_secret(path), path)


def _parse(text: str, path: Path) -> HostKeys:
    parts = text.split()
    if len(parts) != 3 or parts[0] != _HEADER:
        raise PeerRefused(
            Problem("FILE_MALFORMED", f"it is not one line of `{_HEADER}`", where=str(path))
        )
    public, secret = parse_key(parts[1]), parse_key(parts[2])
    if zmq.curve_public(secret.encode("ascii")).decode("ascii") != public:
        raise PeerRefused(
            Problem("KEY_MALFORMED", "the public key is not the secret one's", where=str(path))
        )
    return HostKeys(public, secret)


def _malformed(text: str) -> Problem:
    return Problem(
        "KEY_MALFORMED", "a public key is 40 characters of Z85", have=f"{len(text)} characters"
    )
