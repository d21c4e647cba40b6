"""Whether a contents list may be believed: the one function that every host and tool asks.

    read once → `judge` (signatures, then who signed, then the list itself) → parse

Pure: it reads no clock and no file. What it does not know (which releases were active here, what
the manifest asks for) is judged by those who do, from the `Grant` that it gives.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import contents as lists
from nondum.wheelhouse.format.contents import Contents
from nondum.wheelhouse.format.manifest import GRANTABLE
from nondum.wheelhouse.format.signatures import EVERYTHING, Grant, Verdict
from nondum.wheelhouse.trust import sshsig
from nondum.wheelhouse.trust.public_key import PublicKey
from nondum.wheelhouse.trust.sshsig import Signature
from nondum.wheelhouse.trust.trust import ANY, Role, Trust, TrustedKey

EARLIEST = datetime(2026, 7, 1, tzinfo=UTC)
"""No clock that shows an earlier moment is right: nondum is younger. Raised by each release."""


@frozen
class Circumstances:
    """Where and when is judged."""

    host: str = ""
    """Name of the host; empty: it is not asked whether a payload is meant for it."""
    now: datetime | None = None
    """UTC, by the host's clock; None: it is not asked whether keys hold now."""


def judge(
    trust: Trust | None, contents: bytes, signature: bytes | None, at: Circumstances
) -> Verdict:
    """Judge the bytes of a contents list by those of its signature file (None: there is none).

    `trust` is None on a host without a trust file. Never raises.
    """
    try:
        signatures = _signatures(contents, signature)
    except PayloadRefused as refused:
        return Verdict((), refused.problems)
    keys = tuple(dict.fromkeys(found.key for found in signatures))
    signers = tuple(_name(trust, key) for key in keys)
    if trust is None:
        return Verdict(signers, tuple(_untrusted(None, key) for key in keys))
    doubts = [_doubt(trust, key, at.now) for key in keys]
    believed = [doubt.key for doubt in doubts if doubt.key is not None]
    problems = tuple(doubt.problem for doubt in doubts if doubt.problem is not None)
    if not believed:
        return Verdict(signers, problems)
    try:
        listed = lists.parse(contents, lists.NAME)
    except PayloadRefused as refused:
        return Verdict(signers, refused.problems)
    owners = trust.owners(listed.payload_id)
    role = next((role for role in owners if _is_signed_by(role, believed)), None)
    if role is None:
        refusal = _refusal(owners, believed, listed)
        return Verdict(signers, (*problems, refusal))
    if flaws := tuple(_misdirections(trust, listed, at.host)):
        return Verdict(signers, flaws)
    unsure = clock_unsure(trust, at.now) if at.now is not None else None
    warnings = (unsure,) if unsure is not None else ()
    return Verdict(signers, (), warnings, _grant(trust, owners, role, listed))


def clock_floor(trust: Trust | None) -> datetime:
    """The moment that is certainly past: only what roots have signed is believed about it, since
    any other signer could end the keys of all by a date in the future."""
    return max(EARLIEST, trust.made) if trust is not None else EARLIEST


def clock_unsure(trust: Trust | None, now: datetime) -> Problem | None:
    """What is wrong with a clock that shows a moment before what is certainly past (CLOCK_UNSURE).

    None: it may be right.
    """
    floor = clock_floor(trust)
    if now >= floor:
        return None
    told = "the clock is wrong, so whether keys still hold is judged by the last date that is sure"
    fix = "set the clock of this host (`date -s`), or let it reach a time server"
    return Problem("CLOCK_UNSURE", told, "clock", f"{floor:%F} or later", f"{now:%F}", fix)


@frozen
class Judging:
    """The verifier of a host that goes by a trust file, or has none yet."""

    trust: Trust | None
    at: Circumstances

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Judge."""
        return judge(self.trust, contents, signature, self.at)


@frozen
class Developing:
    """The verifier where `allow_unsigned` is set: what is signed is judged all the same, where
    there is a trust file to judge it by."""

    trust: Trust | None
    at: Circumstances

    def verify(self, contents: bytes, signature: bytes | None) -> Verdict:
        """Judge what is signed; believe what is not."""
        if signature is None or self.trust is None:
            return Verdict((), grant=EVERYTHING)
        return judge(self.trust, contents, signature, self.at)


def _signatures(contents: bytes, signature: bytes | None) -> Sequence[Signature]:
    """All signatures, each of which holds. Raises `PayloadRefused`."""
    if signature is None:
        told, fix = "the payload is not signed", "sign it: `nondum payload sign DIR --key KEY`"
        raise PayloadRefused(Problem("SIG_MISSING", told, where=lists.SIGNATURE_NAME, fix=fix))
    found = sshsig.parse(signature, lists.SIGNATURE_NAME)
    for one in found:
        if one.namespace != sshsig.PAYLOAD:
            raise PayloadRefused(
                Problem(
                    "SIG_WRONG_PURPOSE",
                    "a signature was not made for payloads",
                    where=lists.SIGNATURE_NAME,
                    need=f"namespace {sshsig.PAYLOAD}",
                    have=one.namespace[:60],
                    fix="sign it: `nondum payload sign DIR --key KEY`",
                )
            )
        if not one.holds(contents):
            raise PayloadRefused(
                Problem(
                    "SIG_INVALID",
                    f"the signature of {one.key.fingerprint} does not fit the contents list",
                    where=lists.SIGNATURE_NAME,
                    fix="the list was changed after it was signed: get the payload again",
                )
            )
    return found


@frozen
class _Doubt:
    """What is to be said against a key; nothing is, if it is `key`."""

    key: TrustedKey | None
    problem: Problem | None = None


def _doubt(trust: Trust, key: PublicKey, now: datetime | None) -> _Doubt:
    if (gone := trust.revocation(key)) is not None:
        return _Doubt(None, _revoked(_name(trust, key), key, gone.why))
    known = trust.named(key)
    if known is None:
        return _Doubt(None, _untrusted(trust, key))
    problem = _out_of_time(trust, known, now)
    return _Doubt(known if problem is None else None, problem)


def _untrusted(trust: Trust | None, key: PublicKey) -> Problem:
    by = "this host trusts no key yet" if trust is None else f"{trust.owner} does not trust the key"
    fix = (
        "`nondum keys trust FILE` with its owner's trust file"
        if trust is None
        else f"if it should: nondum keys allow FILE '{key.line}' --name NAME --payloads ID, "
        "then `nondum keys sign FILE` and `nondum keys trust FILE`"
    )
    return Problem("SIG_UNTRUSTED", by, lists.SIGNATURE_NAME, have=key.fingerprint, fix=fix)


def _revoked(name: str, key: PublicKey, why: str) -> Problem:
    told = f"the key {name} was revoked" + (f": {why}" if why else "")
    fix = "ask for a payload that is signed with another key"
    return Problem("SIG_REVOKED", told, lists.SIGNATURE_NAME, have=key.fingerprint, fix=fix)


def _out_of_time(trust: Trust, known: TrustedKey, now: datetime | None) -> Problem | None:
    """Why a key does not hold now. By a clock that is wrong, only what is certain counts: that the
    clock's floor is past."""
    if now is None:
        return None
    sure = max(now, clock_floor(trust))
    if known.until is not None and sure >= known.until:
        told = f"the key {known.name} does not hold any more"
        need, have = f"a date before {known.until:%F %T}", f"{sure:%F %T} (UTC)"
        fix = "have the payload signed with a key that holds; if the date is wrong, set the clock"
        return Problem("SIG_EXPIRED", told, lists.SIGNATURE_NAME, need, have, fix)
    is_right = clock_unsure(trust, now) is None
    if known.since is not None and now < known.since and is_right:
        told = f"the key {known.name} does not hold yet"
        need, have = f"a date from {known.since:%F %T} on", f"{now:%F %T} (UTC)"
        fix = "if the date is wrong, set the clock"
        return Problem("SIG_NOT_YET", told, lists.SIGNATURE_NAME, need, have, fix)
    return None


def _name(trust: Trust | None, key: PublicKey) -> str:
    known = trust.named(key) if trust is not None else None
    return known.name if known is not None else key.fingerprint


def _is_signed_by(role: Role, believed: Sequence[TrustedKey]) -> bool:
    return len({known.name for known in believed} & set(role.keys)) >= role.threshold


def _refusal(owners: Sequence[Role], believed: Sequence[TrustedKey], listed: Contents) -> Problem:
    """Why those who signed may not bring it."""
    names, where = {known.name for known in believed}, listed.payload_id
    who = ", ".join(sorted(names))
    if not owners:
        told = "no role may bring a payload of this id"
        fix = f"add it to a role of {who} in the trust file"
        return Problem("ID_NOT_ALLOWED", told, where, have=f"signed by {who}", fix=fix)
    signed = max(owners, key=lambda role: len(names & set(role.keys)))
    count = len(names & set(signed.keys))
    if count:
        told = "too few have signed it"
        need = f"{signed.threshold} of {', '.join(signed.keys)}"
        fix = "have it signed by more of them: `nondum payload sign DIR --key KEY` adds a signature"
        return Problem("SIG_TOO_FEW", told, where, need, f"{count}: {who}", fix)
    told = "payloads of this id are another's"
    need = " or ".join(f"{role.name} ({', '.join(role.keys)})" for role in owners)
    fix = "build it under an id of your own, or add the key to that role in the trust file"
    return Problem("ID_OWNED_BY", told, where, need, f"signed by {who}", fix)


def _misdirections(trust: Trust, listed: Contents, host: str) -> Iterator[Problem]:
    """What a list that is believed says against its being here."""
    where, bounds = listed.payload_id, trust.bound(listed.payload_id)
    if listed.fleet and listed.fleet not in trust.fleets:
        have = f"this host's: {', '.join(trust.fleets) or 'none'}"
        told, fix = "the payload is for another fleet", "plug it into a robot of that fleet"
        yield Problem("WRONG_TARGET", told, where, f"fleet {listed.fleet}", have, fix)
    if listed.hosts and host and host not in listed.hosts:
        told, fix = "the payload is for other hosts", "plug it into one of those"
        yield Problem("WRONG_TARGET", told, where, ", ".join(listed.hosts), host, fix)
    if listed.release < bounds.least:
        told, fix = "the owner of this host wants no release so old", "plug in a newer release"
        need, have = f"release {bounds.least} or newer", f"release {listed.release}"
        yield Problem("ROLLBACK", told, where, need, have, fix)
    if bounds.most is not None and listed.release > bounds.most:
        told, fix = "the owner of this host wants no release so new", "plug in an older release"
        need, have = f"release {bounds.most} or older", f"release {listed.release}"
        yield Problem("RELEASE_JUMP", told, where, need, have, fix)


def _grant(trust: Trust, owners: Sequence[Role], role: Role, listed: Contents) -> Grant:
    return Grant(
        permissions=GRANTABLE if ANY in role.permissions else role.permissions,
        role=role.name,
        owners=tuple(owner.name for owner in owners),
        most_release=trust.bound(listed.payload_id).most,
        most=role.most,
    )
