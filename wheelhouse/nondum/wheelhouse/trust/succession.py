"""Which trust file may follow which: version N+1 after N, signed by the roots of both.

As TUF has it for its root (theupdateframework/specification, section 5.3): the current roots sign,
so that no one else can change them; the new ones sign too, which proves that their keys work and
can sign the next version. A file is parsed once enough current roots have signed it, not before.

A chain begins with a file that its own roots have signed: a person who compares their fingerprints
has then seen to everything in it. What root has written to the host's own disk needs no signature.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

from nondum.sdk.errors import NondumError, PayloadRefused, Problem, TrustRefused
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.trust import sshsig, trust_file
from nondum.wheelhouse.trust.trust import Roots, Trust

_SIGN = "`nondum keys sign FILE --key KEY`, once for each root, adds signatures"
_FIRST = (
    "get the file and its .sig again from its owner; or, as the owner, sign it: `nondum keys sign "
    "FILE --key KEY`"
)
_PLACED = (
    "put the genuine file and its .sig there; delete the .sig only if you vouch for the file "
    "yourself"
)


@frozen
class SignedFile:
    """A trust file and its signatures, as bytes that are not parsed yet."""

    data: bytes
    signature: bytes | None
    where: str = trust_file.NAME

    @property
    def digest(self) -> str:
        """SHA-256 of the file."""
        return hashlib.sha256(self.data).hexdigest()


@frozen
class Extended:
    """The current trust after files were offered, and which of them were accepted."""

    trust: Trust
    accepted: tuple[SignedFile, ...] = ()
    """In the order of their versions."""
    problems: tuple[Problem, ...] = ()
    """Of the files that were refused."""


def extend(trust: Trust, known: Sequence[str], offered: Sequence[SignedFile]) -> Extended:
    """Follow the chain as far as it leads; `known` are digests of the files that led to `trust`."""
    accepted: list[SignedFile] = []
    left = [file for file in offered if file.digest not in known]
    problems: dict[str, tuple[Problem, ...]] = {}
    is_longer = True
    while left and is_longer:
        is_longer = False
        for file in tuple(left):
            try:
                trust = successor(trust, file)
            except NondumError as refused:
                problems[file.digest] = refused.problems
            else:
                accepted.append(file)
                left = [other for other in left if other.digest != file.digest]
                is_longer = True
    told = (problem for file in left for problem in problems[file.digest])
    return Extended(trust, tuple(accepted), tuple(dict.fromkeys(told)))


def successor(trust: Trust, file: SignedFile) -> Trust:
    """The trust that a file sets when it follows `trust`.

    Raises `TrustRefused` (TRUST_SIGNATURE, TRUST_OWNER, TRUST_VERSION, TRUST_…), `PayloadRefused`
    (SIG_MALFORMED, SIG_WRONG_PURPOSE).
    """
    _check_signed(trust.roots, f"version {trust.version}", file)
    new = trust_file.parse_bytes(file.data, file.where)
    if new.owner != trust.owner:
        told, fix = "it is another owner's trust file", "only its own owner's can follow"
        raise _refused("TRUST_OWNER", told, file, trust.owner, new.owner, fix)
    if new.version != trust.version + 1:
        raise _out_of_order(trust, new, file)
    if new.made < trust.made:
        told, fix = "it was made before the active one", "write the current date into `made`"
        need, have = f"{trust.made:%F %T} or later", f"{new.made:%F %T}"
        raise _refused("TRUST_VERSION", told, file, need, have, fix)
    _check_signed(new.roots, f"version {new.version}", file)
    return new


def first(file: SignedFile) -> Trust:
    """The trust that begins with a file that a person brings: enough of the roots that it names
    have signed it. Raises `TrustRefused` (TRUST_SIGNATURE, TRUST_…)."""
    return _begun(file, _FIRST)


def placed(file: SignedFile) -> Trust:
    """The trust that begins with a file on the host's own disk: without a signature, who may write
    there vouches for it; one that is there holds. Raises as `first`."""
    if file.signature is None:
        return trust_file.parse_bytes(file.data, file.where)
    return _begun(file, _PLACED)


def _begun(file: SignedFile, fix: str) -> Trust:
    trust = trust_file.parse_bytes(file.data, file.where)
    try:
        _check_signed(trust.roots, f"version {trust.version}", file)
    except NondumError as refused:
        told = (replace(problem, code="TRUST_SIGNATURE", fix=fix) for problem in refused.problems)
        raise TrustRefused(*told) from refused
    return trust


def signers(file: SignedFile) -> frozenset[bytes]:
    """The keys (their 32 bytes) whose signatures over a trust file hold.

    Raises `TrustRefused` (TRUST_SIGNATURE), `PayloadRefused` (SIG_MALFORMED, SIG_WRONG_PURPOSE).
    """
    if file.signature is None:
        raise _refused("TRUST_SIGNATURE", "it is not signed", file, "", "", _SIGN)
    where, points = f"{file.where}.sig", set()
    for one in sshsig.parse(file.signature, where):
        if one.namespace != sshsig.TRUST:
            told, need = "a signature was not made for trust files", f"namespace {sshsig.TRUST}"
            have = one.namespace[:60]
            raise PayloadRefused(Problem("SIG_WRONG_PURPOSE", told, where, need, have, _SIGN))
        if not one.holds(file.data):
            told = f"the signature of {one.key.fingerprint} does not fit it"
            fix = "it was changed after it was signed: get it again, or sign it again"
            raise _refused("TRUST_SIGNATURE", told, file, "", "", fix)
        points.add(one.key.point)
    return frozenset(points)


def _check_signed(roots: Roots, whose: str, file: SignedFile) -> None:
    points = signers(file)
    signed = sorted(root.name for root in roots.keys if root.key.point in points)
    if len(signed) < roots.threshold:
        names = ", ".join(root.name for root in roots.keys)
        told = f"too few of the roots of {whose} have signed it"
        need, have = f"{roots.threshold} of {names}", ", ".join(signed) or "none of them"
        raise _refused("TRUST_SIGNATURE", told, file, need, have, _SIGN)


def _out_of_order(trust: Trust, new: Trust, file: SignedFile) -> TrustRefused:
    need, have = f"version {trust.version + 1}", f"version {new.version}"
    if new.version == trust.version:
        told = "its roots have signed another trust file of the same version as the active one"
        fix = "find out which is genuine: somebody may have the keys of the roots"
        return _refused("TRUST_CONFLICT", told, file, need, have, fix)
    if new.version < trust.version:
        told, fix = "an older trust file than the active one", "bring the newest one"
    else:
        told, fix = "versions are missing between", "bring those in between, too"
    return _refused("TRUST_VERSION", told, file, need, have, fix)


def _refused(
    code: str, told: str, file: SignedFile, need: str, have: str, fix: str
) -> TrustRefused:
    return TrustRefused(Problem(code, told, file.where, need, have, fix))
