"""What an owner does to a trust file: pure changes, each from one trust to another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import datetime
from typing import NoReturn

from nondum.sdk.errors import Problem, TrustRefused
from nondum.wheelhouse.trust.public_key import FINGERPRINT, PublicKey
from nondum.wheelhouse.trust.trust import ANY, Revocation, Role, Roots, Trust, TrustedKey

OWNER_ROLE = "owner"


def begun(
    owner: str,
    roots: Sequence[TrustedKey],
    signers: Sequence[TrustedKey],
    *,
    threshold: int,
    fleets: Sequence[str],
    made: datetime,
) -> Trust:
    """The first version: signers may bring any payload, and it may ask for anything."""
    names = tuple(signer.name for signer in signers)
    role = Role(OWNER_ROLE, (ANY,), names, permissions=(ANY,))
    return Trust(
        owner=owner,
        version=1,
        made=made,
        roots=Roots(tuple(roots), threshold),
        fleets=tuple(fleets),
        keys=tuple(signers),
        roles=(role,) if signers else (),
    )


def allowed(trust: Trust, key: TrustedKey, role: Role) -> Trust:
    """Let a key bring payloads: in a new role, or beside other keys in an existing one.

    Raises `TrustRefused` (KEY_TAKEN, KEY_REVOKED).
    """
    if trust.revocation(key.key) is not None:
        fix = "make another one: what it signed before would be believed again, too"
        _refuse("KEY_REVOKED", f"the key {key.key.fingerprint} was revoked", fix)
    for known in trust.keys:
        is_it = known.key.point == key.key.point
        if is_it != (known.name == key.name):
            told = f"{known.name!r} is the name of {known.key.fingerprint}"
            _refuse("KEY_TAKEN", told, "one key has one name: choose another, or that one")
    keys = [known for known in trust.keys if known.name != key.name]
    others = [other for other in trust.roles if other.name != role.name]
    before = next((other for other in trust.roles if other.name == role.name), None)
    joined = role if before is None else _joined(before, role)
    return replace(trust, keys=(*keys, key), roles=(*others, joined))


def revoked(trust: Trust, key: PublicKey | str, why: str) -> Trust:
    """Never believe a key again, given itself or by its fingerprint; a root is one no more.

    Raises `TrustRefused` (ROOTS_TOO_FEW).
    """
    fingerprint = key if isinstance(key, str) else key.fingerprint
    left = tuple(root for root in trust.roots.keys if root.key.fingerprint != fingerprint)
    if len(left) < trust.roots.threshold:
        told = f"{len(left)} roots would be left, and {trust.roots.threshold} must sign"
        fix = "put another root in its place first: `nondum keys rotate`"
        _refuse("ROOTS_TOO_FEW", told, fix)
    before = [gone for gone in trust.revoked if gone.fingerprint != fingerprint]
    return replace(
        trust,
        roots=replace(trust.roots, keys=left),
        revoked=(*before, Revocation(fingerprint, why)),
    )


def rotated(trust: Trust, name: str, new: PublicKey, *, until: datetime | None) -> Trust:
    """Put a new key in the place of the one of a name, wherever that stands; the old one is unknown
    from then on. Raises `TrustRefused` (KEY_UNKNOWN)."""

    def turned(known: Iterable[TrustedKey]) -> tuple[TrustedKey, ...]:
        return tuple(replace(k, key=new) if k.name == name else k for k in known)

    if name not in {k.name for k in (*trust.keys, *trust.roots.keys)}:
        _unknown(trust, name)
    keys = tuple(
        replace(k, since=None, until=until) if k.name == name else k for k in turned(trust.keys)
    )
    return replace(trust, keys=keys, roots=replace(trust.roots, keys=turned(trust.roots.keys)))


def found(trust: Trust, who: str) -> PublicKey | str:
    """The key that is meant by a name, or a fingerprint as it is. Raises `TrustRefused`
    (KEY_UNKNOWN)."""
    if FINGERPRINT.fullmatch(who):
        return who
    known = next((k for k in (*trust.keys, *trust.roots.keys) if k.name == who), None)
    return known.key if known is not None else _unknown(trust, who)


def following(trust: Trust, made: datetime) -> Trust:
    """The next version."""
    return replace(trust, version=trust.version + 1, made=max(made, trust.made))


def _joined(before: Role, role: Role) -> Role:
    """A role with what another one adds."""
    return replace(
        before,
        payloads=tuple(dict.fromkeys((*before.payloads, *role.payloads))),
        keys=tuple(dict.fromkeys((*before.keys, *role.keys))),
        permissions=tuple(dict.fromkeys((*before.permissions, *role.permissions))),
    )


def _unknown(trust: Trust, who: str) -> NoReturn:
    known = sorted({k.name for k in (*trust.keys, *trust.roots.keys)})
    _refuse("KEY_UNKNOWN", f"there is no key {who!r}", f"there is: {', '.join(known) or 'none'}")


def _refuse(code: str, told: str, fix: str) -> NoReturn:
    raise TrustRefused(Problem(code, told, fix=fix))
