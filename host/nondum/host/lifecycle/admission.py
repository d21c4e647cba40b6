"""Whether a release of a payload may come in, after those that were here."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime

from nondum.host.core.events.payloads import PayloadActivated, PayloadFound
from nondum.host.core.records.moment import Moment
from nondum.host.core.records.payload import PayloadRecord
from nondum.host.core.state import Highwater, HostState
from nondum.host.lifecycle import releases
from nondum.sdk.errors import Problem
from nondum.wheelhouse.format.signatures import Grant
from nondum.wheelhouse.trust.judging import EARLIEST

RELEASE_JUMP = 1_000_000
"""A release this far ahead of the newest known, of the clock and of the date that it states
(releases may be build times) would lock out every honest one after it."""

FARTHEST_DATE_S = 20 * 366 * 86400
"""A payload that says that it was built later than this after the clock's floor is not believed:
its date lets its release go as far ahead where this host's clock is behind."""

_NOTHING = Highwater(0, "")


def release_problems(state: HostState, found: PayloadFound, at: Moment) -> Iterator[Problem]:
    """What the releases that were active here have against this one."""
    if not found.version:  # its list is not believed, so its release is not known
        return
    where, newest = found.payload_id, _newest(state, found)
    limit = max(newest.release, int(at.wall_s), _date_s(found)) + RELEASE_JUMP
    owner = newest.owner
    if owner in found.grant.owners and found.grant.role != owner:
        yield Problem(
            "ID_OWNED_BY",
            f"the role {owner} was the first to bring it, and has its next releases",
            where=where,
            need=f"signed by {owner}",
            have=f"signed by {found.grant.role} ({', '.join(found.signers)})",
            fix="build it under another id, or leave it to one role in the trust file",
        )
    if found.release < newest.release and not releases.is_overruled(state, found):
        yield Problem(
            "ROLLBACK",
            "an older release than was active here before",
            where=where,
            need=f"release {newest.release} or newer",
            have=f"release {found.release}",
            fix=f"plug in the newer release, or `nondum payload rollback {where}`",
        )
    elif found.release == newest.release and newest.digest not in ("", found.digest):
        yield Problem(
            "RELEASE_CONFLICT",
            f"release {found.release} was active here before, with other content",
            where=where,
            fix="find out which is genuine; a changed payload needs a higher release",
        )
    elif (twin := releases.twin(state, found)) is not None:
        yield Problem(
            "RELEASE_CONFLICT",
            f"release {found.release} is here already, with other content",
            where=where,
            have=f"another one on {', '.join(twin.drives)}",
            fix="find out which is genuine; a changed payload needs a higher release",
        )
    elif found.release > limit:
        yield Problem(
            "RELEASE_JUMP",
            "the release is implausibly far ahead",
            where=where,
            need=f"at most {limit}",
            have=str(found.release),
            fix="build it again with a plausible --release",
        )


def reached(state: HostState, payload: PayloadRecord, event: PayloadActivated) -> Highwater:
    """The newest release of a payload that is active, now that this one is."""
    newest = state.highwater.get(payload.payload_id, _NOTHING)
    owner = newest.owner if newest.owner in event.grant.owners else event.grant.role
    if newest.release > payload.release and not _is_void(newest, event.grant):
        return replace(newest, owner=owner)
    return Highwater(payload.release, payload.digest, owner)


def _newest(state: HostState, found: PayloadFound) -> Highwater:
    """The newest release known, for whatever fleet: which one is its signer's word. The owner of
    this host may have declared it void."""
    newest = state.highwater.get(found.payload_id, _NOTHING)
    if _is_void(newest, found.grant):
        return replace(_NOTHING, owner=newest.owner)
    return newest


def _is_void(newest: Highwater, grant: Grant) -> bool:
    return grant.most_release is not None and newest.release > grant.most_release


def _date_s(found: PayloadFound) -> int:
    """When it was built, as it says and as far as that is believed; seconds since 1970."""
    floor_s = int(EARLIEST.timestamp())
    try:
        built = datetime.fromisoformat(found.built)
    except ValueError:
        return floor_s
    return min(int(built.timestamp()), floor_s + FARTHEST_DATE_S)
