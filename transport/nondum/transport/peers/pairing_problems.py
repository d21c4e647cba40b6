"""What people are told when a pairing comes to nothing, and what they can do about it."""

from __future__ import annotations

from dataclasses import replace

from nondum.sdk.errors import Problem
from nondum.transport.peers import pairing
from nondum.transport.peers.keys import PeerKey, fingerprint
from nondum.transport.peers.pairing_messages import Ending

_AGAIN = "if that was not meant, begin again on both hosts: `nondum peers pair`"
_BOTH = "run `nondum peers pair` on both hosts at the same time, on one network"
_RENAME = (
    "give one of the two another name, `name` under [host], start it again, and pair them then"
)

SAID_NO = Problem("PAIRING_REFUSED", "the person at this host said no")
CLOSED = Problem("PAIRING_OVER", "pairing was given up at this host", fix=_BOTH)
VANISHED = Problem("PAIRING_VANISHED", "the other host is gone, or says nothing any more")
BROKEN = Problem("PAIRING_BROKEN", "the other host does not speak as nondum does")

_ENDINGS = {
    Ending.REFUSED: Problem("PAIRING_REFUSED", "the other host does not want to"),
    Ending.BUSY: Problem("PAIRING_BUSY", "the other host is being paired with another one"),
    Ending.UNWANTED: Problem(
        "PAIRING_UNWANTED",
        "the other host waits for another one, or has revoked this one's key",
        fix="look at `nondum peers trust` there",
    ),
    Ending.TRIES: Problem(
        "PAIRING_TRIES", "the other host has had too many attempts", fix="begin again on both hosts"
    ),
    Ending.OVER: Problem("PAIRING_OVER", "the other host has closed its window", fix=_BOTH),
    Ending.BROKEN: Problem("PAIRING_BROKEN", "the other host did not understand this one"),
}


def ended(
    why: Ending, name: str, *, own_name: str, is_confirmed: bool, is_confirmed_there: bool
) -> Problem:
    """Why the other end, which calls itself `name` (empty: it has not said), has given up a try.

    `is_confirmed`: the person here had said yes; `is_confirmed_there`: the one there.
    """
    if why is Ending.REFUSED and name:
        told = "the person at the other host said no: the codes differ, or it was not wanted"
        return Problem("PAIRING_REFUSED", told, where=name, fix=_AGAIN)
    if why is Ending.NAME:
        told = f"the other host is called {own_name} too, or knows another host of that name"
        return Problem("PAIRING_NAME", told, where=own_name, fix=_RENAME)
    if why is Ending.OVER and name:
        who = _silent(name, is_confirmed=is_confirmed, is_confirmed_there=is_confirmed_there)
        again = "run `nondum peers pair` there again: the yes that was given here still holds"
        fix = again if is_confirmed else _BOTH
        return Problem("PAIRING_OVER", f"{name} has closed its window: {who}", where=name, fix=fix)
    return replace(_ENDINGS[why], where=name)


def same_name(name: str) -> Problem:
    """Both hosts are called so."""
    told = f"both hosts are called {name}, and names are what hosts are known by"
    return Problem("PAIRING_NAME", told, where=name, fix=_RENAME)


def name_known(name: str, key: PeerKey, holder: PeerKey) -> Problem:
    """A host with a key is called as another one is that is known here."""
    told = f"another host called {name} is known here already, {fingerprint(holder)}"
    fix = f"{_RENAME}; if the other is gone for good: `nondum peers forget {fingerprint(holder)}`"
    return Problem("PAIRING_NAME", told, where=name, have=fingerprint(key), fix=fix)


def unanswered(name: str, *, is_confirmed: bool, is_confirmed_there: bool) -> Problem:
    """The time was over while the people compared the code."""
    who = _silent(name, is_confirmed=is_confirmed, is_confirmed_there=is_confirmed_there)
    return Problem("PAIRING_OVER", f"{_TIME_IS_OVER}: {who}", where=name, fix=_BOTH)


def unmet(last: Problem | None) -> Problem:
    """The time was over and no code was shown; `last` is what became of the last try."""
    if last is None:
        return Problem("PAIRING_OVER", _TIME_IS_OVER, fix=_BOTH)
    if last.code == "PAIRING_OVER":
        return replace(last, message=f"{_TIME_IS_OVER}; {last.message}", fix=_BOTH)
    told = f"{_TIME_IS_OVER}; the last try ended with {last.code}: {last.message}"
    return Problem("PAIRING_OVER", told, fix=last.fix or _BOTH)


def _silent(name: str, *, is_confirmed: bool, is_confirmed_there: bool) -> str:
    """The people who have not answered, in words."""
    if is_confirmed:
        return f"no one at {name} has said yes"
    if is_confirmed_there:
        return f"the person at {name} has said yes, and no one at this host"
    return f"no one has said yes, here or at {name}"


_TIME_IS_OVER = f"the {pairing.WINDOW_S:.0f} seconds for pairing are over"
