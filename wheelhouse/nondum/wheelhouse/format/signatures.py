"""The seam behind which signatures are judged.

Whatever verifies gets the bytes of the contents list, before anything in them is parsed, and the
bytes of the signature file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, cast

from nondum.sdk.codec.values import from_plain, to_plain
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import goals as goal_file
from nondum.wheelhouse.format.limits import WorkerLimits, not_granted
from nondum.wheelhouse.format.manifest import DATA, GOALS, GRANTABLE, Manifest

MAX_SIGNATURE_BYTES = 8 * 1024


@frozen
class Grant:
    """What a payload that is believed may have."""

    permissions: tuple[str, ...] = ()
    """What it may ask for."""
    role: str = ""
    """The role in the trust file by which it is believed; empty: it is not by one."""
    owners: tuple[str, ...] = ()
    """The roles that may bring a payload of its id: whose was first, brings the next ones."""
    most_release: int | None = None
    """Newer releases are void, whatever came in before."""
    most: WorkerLimits = WorkerLimits()
    """The most that its workers may ask for."""

    def to_dict(self) -> dict[str, Any]:
        """The grant as plain data."""
        return cast(dict[str, Any], to_plain(self))

    @classmethod
    def parse(cls, said: Mapping[str, Any]) -> Grant:
        """Read what `to_dict` gave, from our own child."""
        return from_plain(cls, said)

    def problems(self, manifest: Manifest, goals: Sequence[str] = ()) -> tuple[Problem, ...]:
        """What a payload asks for and is not granted (PERMISSION_DENIED, LIMIT_NOT_GRANTED)."""
        asked = [(c.id, permission) for c in manifest.components for permission in c.permissions]
        if goals:
            asked.append((goal_file.NAME, GOALS))
        asked.extend((f"data {brought.name}", DATA) for brought in manifest.data)
        by = f"the role {self.role}" if self.role else "its signer"
        denied = tuple(
            Problem(
                "PERMISSION_DENIED",
                f"the payload asks for {permission!r}, which {by} may not give",
                where=where,
                need=permission,
                have=", ".join(self.permissions) or "no permissions",
                fix=f"leave it out, or add {permission!r} to that role in the trust file",
            )
            for where, permission in asked
            if permission not in self.permissions
        )
        fix = "ask for less, or raise {key} under `most` of that role in the trust file"
        return denied + tuple(
            problem
            for component in manifest.components
            for problem in not_granted(component.id, component.limits, self.most, by, fix)
        )


NOTHING = Grant()
"""What is granted where no signer is trusted."""

EVERYTHING = Grant(GRANTABLE)
"""What is granted where no signatures are demanded."""


@frozen
class Verdict:
    """Whether a contents list may be believed, in whose name, and what for."""

    signers: tuple[str, ...]
    """Names (fingerprints of those without) of keys whose signatures hold; empty: no key signed
    it."""
    problems: tuple[Problem, ...] = ()
    """Why it is refused; empty: it is not."""
    warnings: tuple[Problem, ...] = ()
    """What is doubtful, and does not keep it out."""
    grant: Grant = NOTHING
    """What it may have, if it is not refused."""


class Verifier(Protocol):
    """Judges contents lists."""

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Judge the bytes of a contents list; `signature` is None when there is no file."""
        ...


class UnsignedAllowed:
    """Believes everything: for development, where `allow_unsigned` is set."""

    warning = "payloads without a signature are accepted (allow_unsigned)"
    """What every status must say while this verifier is used."""

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Accept."""
        return Verdict(signers=(), grant=EVERYTHING)
