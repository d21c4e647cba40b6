"""The seam behind which signatures are judged.

Whatever verifies gets the bytes of the contents list, before anything in them is parsed, and the
bytes of the signature file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from nondum.sdk.errors import Problem

MAX_SIGNATURE_BYTES = 8 * 1024


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a contents list may be believed, and in whose name."""

    signers: tuple[str, ...]
    """Fingerprints or names of keys whose signatures hold; empty: nobody vouches for it."""
    problems: tuple[Problem, ...] = ()
    """Why it is refused; empty: it is not."""


class Verifier(Protocol):
    """Judges contents lists."""

    warning: str
    """What every status must say while this verifier is in force; empty: nothing."""

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Judge the bytes of a contents list; `signature` is None when there is no file."""
        ...


class UnsignedAllowed:
    """Believes everything: for development, where `allow_unsigned` is set."""

    warning = "payloads without a signature are accepted (allow_unsigned)"

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Accept."""
        return Verdict(signers=())


class SignatureDemanded:
    """Refuses everything: this nondum cannot verify signatures yet, and none may be left out."""

    warning = ""

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Refuse."""
        if signature is None:
            message, fix = "the payload is not signed", "sign it, or set allow_unsigned to develop"
            return Verdict((), (Problem("SIG_MISSING", message, fix=fix),))
        message = "signatures cannot be verified by this version of nondum"
        fix = "set allow_unsigned in [drives] to accept payloads for development"
        return Verdict((), (Problem("SIG_UNTRUSTED", message, fix=fix),))
