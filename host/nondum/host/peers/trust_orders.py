"""What people's tools may ask of, and have done to, the trust of a running host.

verbs |= trust_orders.answering(orders)      # in `verbs.answering`
verbs |= trust_orders.following(orders)      # in `verbs.following`
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Mapping
from dataclasses import replace
from datetime import datetime
from typing import Any

from nondum.host.control.arguments import Arguments
from nondum.host.core.row import Row
from nondum.host.peers.pairing_requests import PairingRequests
from nondum.host.peers.trust_store import PeerTrustStore
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers.certificate import check_name
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import PeerKey, fingerprint, parse_key
from nondum.transport.peers.public_file import parse_fleet

MOST_WORDS = 200
"""Characters that are kept of why a key was revoked."""


@frozen
class TrustOrders:
    """Each method is a verb."""

    trust_store: PeerTrustStore
    requests: PairingRequests
    known: Callable[[], Mapping[PeerKey, str]]
    """Hosts that are here or were, paired or certified: key → name. So that people can name hosts
    that a fleet has let in."""

    async def trust(self, arguments: Arguments) -> Row:
        """Who is let in, and who this host is."""
        trust_store = self.trust_store
        return {
            **await self.key(arguments),
            "certificate": self._certificate_row(),
            "fleets": [_row(key, name=name) for key, name in trust_store.trust.fleets.items()],
            "paired": [_row(key, name=name) for key, name in trust_store.trust.paired.items()],
            "revoked": [_row(key, why=why) for key, why in trust_store.trust.revoked.items()],
            "warnings": [problem.to_dict() for problem in trust_store.warnings],
        }

    async def key(self, arguments: Arguments) -> Row:
        """This host's public key."""
        host = self.trust_store.host
        return {"name": host.name, **_row(host.key), "public": host.to_text()}

    def pair(self, arguments: Arguments) -> AsyncIterator[Row]:
        """Open the window, to any host or to the one named `host`: see `PairingRequests.pair`."""
        return self.requests.pair(arguments.optional_text("host"))

    async def confirm(self, arguments: Arguments) -> Row:
        """Both hosts show this `code`: how the window stands now, or with `wait`, at its end.

        Raises `PeerRefused` (PAIRING_ORDER, PAIRING_CODE).
        """
        self.requests.confirm(arguments.text("code"))
        return await self.requests.ended() if arguments.flag("wait") else self.requests.row() or {}

    async def refuse(self, arguments: Arguments) -> Row:
        """Close the window. Raises `PeerRefused` (PAIRING_ORDER)."""
        self.requests.refuse()
        return {}

    async def revoke(self, arguments: Arguments) -> Row:
        """Never let in a key again, `who` by name, fingerprint or key, and `why`.

        Raises `PeerRefused` (PEER_UNKNOWN, PEER_AMBIGUOUS, KEY_OWN, PEERS_FOLDER).
        """
        trust = self.trust_store.trust
        names = _all(self.known(), trust.paired)
        key = _one(arguments.text("who"), names, may_be_new=True)
        why = arguments.text("why")[:MOST_WORDS]
        name = names.get(key, "")
        await self.trust_store.revoke(PeerKey(key), f"{why} ({name})" if name else why)
        return _row(key, name=name, why=why)

    async def forget(self, arguments: Arguments) -> Row:
        """Forget a paired host or a fleet, `who` by name, fingerprint or key; or that a key was
        revoked, by fingerprint or key.

        Raises `PeerRefused` (PEER_UNKNOWN, PEER_AMBIGUOUS, PEERS_FOLDER).
        """
        trust = self.trust_store.trust
        names = _all(trust.paired, trust.fleets, dict.fromkeys(trust.revoked, ""))
        key = _one(arguments.text("who"), names, may_be_new=False)
        kinds: dict[str, Collection[str]] = {
            "host": trust.paired,
            "fleet": trust.fleets,
            "revocation": trust.revoked,
        }
        kind = next(kind for kind, part in kinds.items() if key in part)
        await self.trust_store.forget(key)
        return _row(key, name=names[key], kind=kind)

    async def certify(self, arguments: Arguments) -> Row:
        """Show this `certificate` (its text) to peers. Raises `PeerRefused`."""
        await self.trust_store.certify(arguments.text("certificate").encode("utf-8"))
        row = self._certificate_row()
        assert row is not None
        return row

    async def trust_fleet(self, arguments: Arguments) -> Row:
        """Let in the hosts that a `fleet` (the text of its public file) certifies; `name` it.

        Raises `PeerRefused` (FILE_MALFORMED, KEY_MALFORMED, HOST_NAME, PEERS_FOLDER).
        """
        fleet = parse_fleet(arguments.text("fleet"))
        name = check_name(arguments.optional_text("name") or fleet.name)
        await self.trust_store.trust_fleet(replace(fleet, name=name))
        return _row(fleet.key, name=name)

    def _certificate_row(self) -> Row | None:
        found = self.trust_store.certificate
        if found is None:
            return None
        fleets = self.trust_store.trust.fleets
        return {
            "host": found.host,
            "fleet": fleets.get(found.fleet, ""),
            "fleet_fingerprint": fingerprint(found.fleet),
            "is_trusted": found.fleet in fleets,
            "not_before": _day(found.not_before),
            "not_after": _day(found.not_after),
        }


def answering(orders: TrustOrders) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
    """Verbs that answer once."""
    return {
        "peers_certify": orders.certify,
        "peers_confirm": orders.confirm,
        "peers_forget": orders.forget,
        "peers_key": orders.key,
        "peers_refuse": orders.refuse,
        "peers_revoke": orders.revoke,
        "peers_trust": orders.trust,
        "peers_trust_fleet": orders.trust_fleet,
    }


def following(orders: TrustOrders) -> dict[str, Callable[[Arguments], AsyncIterator[Row]]]:
    """Verbs that go on answering."""
    return {"peers_pair": orders.pair}


def _all(*parts: Mapping[Any, str]) -> dict[str, str]:
    return {key: name for part in parts for key, name in part.items()}


def _one(who: str, names: Mapping[str, str], *, may_be_new: bool) -> str:
    """The one key that is meant. Raises `PeerRefused` (PEER_UNKNOWN, PEER_AMBIGUOUS)."""
    found = [key for key, name in names.items() if _is_meant(who, key, name)]
    if len(found) == 1:
        return found[0]
    if found:
        prints = ", ".join(fingerprint(key) for key in found)
        told = f"there are {len(found)} of the name {who!r}"
        fix = f"say which by its fingerprint: {prints}"
        raise PeerRefused(Problem("PEER_AMBIGUOUS", told, fix=fix))
    if may_be_new:
        try:
            return parse_key(who)
        except NondumError:
            pass
    known = ", ".join(sorted(f"{name} {fingerprint(key)}".strip() for key, name in names.items()))
    told = f"no host or fleet is known as {who!r}"
    fix = f"known are: {known or 'none'}; a host that is not can be named by its whole key"
    raise PeerRefused(Problem("PEER_UNKNOWN", told, fix=fix))


def _is_meant(who: str, key: str, name: str) -> bool:
    return who in (name, key) or who.upper() == fingerprint(key)


def _row(key: str, **more: str) -> Row:
    return {**more, "fingerprint": fingerprint(key), "key": key}


def _day(moment: datetime) -> str:
    return moment.strftime("%Y-%m-%dT%H:%M:%SZ")
