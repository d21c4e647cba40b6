"""The keys that a robot's owner trusts, and for what: the values of a trust file."""

from __future__ import annotations

from datetime import datetime

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.limits import WorkerLimits
from nondum.wheelhouse.trust.public_key import PublicKey

ANY = "*"
"""In a role: every payload, or every permission."""


@frozen
class TrustedKey:
    """A key that has a name."""

    name: str
    key: PublicKey
    since: datetime | None = None
    """UTC; it is not believed before."""
    until: datetime | None = None
    """UTC; the first moment at which it is not believed any more."""


@frozen
class Roots:
    """Who may change the trust file."""

    keys: tuple[TrustedKey, ...]
    threshold: int
    """How many of them must have signed the next version."""


@frozen
class Role:
    """What some keys may bring, and what that may do."""

    name: str
    payloads: tuple[str, ...]
    """Ids, each with all that begin with it and a dot; `*`: all."""
    keys: tuple[str, ...]
    """Names of keys."""
    threshold: int = 1
    """How many of them must have signed a payload."""
    permissions: tuple[str, ...] = ()
    """What its payloads may ask for; `*`: anything."""
    most: WorkerLimits = WorkerLimits()
    """The most that each of their workers may ask for; a limit that is left out has no bound here.
    """

    def covers(self, payload_id: str) -> int:
        """How closely the role names an id: the length of what it names; -1: not at all.

        >>> role = Role("acme", ("com.acme", "*"), ())
        >>> role.covers("com.acme.arm"), role.covers("com.acmesoft"), Role("", (), ()).covers("a.b")
        (8, 0, -1)
        """
        return max((_closeness(prefix, payload_id) for prefix in self.payloads), default=-1)


@frozen
class Revocation:
    """A key that is never believed again."""

    fingerprint: str
    why: str = ""


@frozen
class Bounds:
    """Which releases of a payload may come in."""

    payload: str
    """Its id."""
    least: int = 0
    most: int | None = None
    """Newer ones are refused, and forgotten where they came in before; None: no bound."""


@frozen
class Trust:
    """A trust file, one version of it."""

    owner: str
    """Who writes it; the same in every version."""
    version: int
    made: datetime
    """UTC."""
    roots: Roots
    fleets: tuple[str, ...] = ()
    """Which fleets the hosts that go by it belong to."""
    keys: tuple[TrustedKey, ...] = ()
    roles: tuple[Role, ...] = ()
    revoked: tuple[Revocation, ...] = ()
    bounds: tuple[Bounds, ...] = ()

    def named(self, key: PublicKey) -> TrustedKey | None:
        """The key, if it has a name here."""
        return next((known for known in self.keys if known.key == key), None)

    def revocation(self, key: PublicKey) -> Revocation | None:
        """Why a key is never believed again, if it is not."""
        return next((gone for gone in self.revoked if gone.fingerprint == key.fingerprint), None)

    def owners(self, payload_id: str) -> tuple[Role, ...]:
        """The roles that name an id most closely: no other may bring it."""
        closeness = max((role.covers(payload_id) for role in self.roles), default=-1)
        if closeness < 0:
            return ()
        return tuple(role for role in self.roles if role.covers(payload_id) == closeness)

    def bound(self, payload_id: str) -> Bounds:
        """Which releases of a payload may come in."""
        known = (bounds for bounds in self.bounds if bounds.payload == payload_id)
        return next(known, Bounds(payload_id))


def _closeness(prefix: str, payload_id: str) -> int:
    if prefix == ANY:
        return 0
    return len(prefix) if f"{payload_id}.".startswith(f"{prefix}.") else -1
