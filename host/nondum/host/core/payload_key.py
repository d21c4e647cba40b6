"""What a host calls a payload: the first half of the SHA-256 of its contents list, in hex.

128 bits, so that no signer can make two lists of one key. Versions of nondum whose
catalogue has schema 6 or less took 64 bits; a payload that came under one keeps that key while it
is there.
"""

from __future__ import annotations

DIGITS = 32
FORMER_DIGITS = 16


def key_of(digest: str) -> str:
    """The key of a payload that is new here, by the digest of its contents list."""
    return digest[:DIGITS]


def is_key_of(key: str, digest: str) -> bool:
    """Whether a payload with this digest is called so, by this version or a former one."""
    return len(key) in (DIGITS, FORMER_DIGITS) and digest.startswith(key)
