"""What a peer's entries mean here. Pure: a stranger's words become the host's values.

What cannot be understood is left out and told; it costs that one entry, not the peer.
"""

from __future__ import annotations

import ipaddress
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from nondum.host.core.events.facts import FactForgotten, FactKnown, StreamFlowing
from nondum.host.core.printable import printable
from nondum.host.core.records.mount import MountPose, Xyz
from nondum.host.core.records.peer import PeerComponent, PeerRecord
from nondum.planning.merge.contribution import peers_id
from nondum.planning.merge.core import TAKEN_PREDICATES
from nondum.planning.pddl.facts import parts
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import MessageInvalid, NondumError, Problem
from nondum.sdk.frozen import frozen
from nondum.sdk.messages import value_from_wire
from nondum.sdk.signature import parse_signature

Entries: TypeAlias = Mapping[str, Mapping[str, Any]]
Claim: TypeAlias = FactKnown | StreamFlowing

BELOW_OWN = 1_000_000
"""Added to the ranks of peers' components: whatever their own host thinks of them, this one's own
come first."""
MOST_COMPONENTS = 1000
MOST_ADDRESSES = 16
_ID = re.compile(r"[a-z0-9][a-z0-9_-]{0,99}")
_FACT = re.compile(r"[^\s()]+ [^\s()]+")
_WORD = re.compile(r"[^\s()]{1,256}")


@frozen
class Introduced:
    """Who a peer is."""

    key: str
    name: str
    address: str
    admitted_by: str
    life: str


class _Wrong(Exception):
    """An entry is not what its key promises; the text says how."""


def record_of(peer: Introduced, entries: Entries) -> PeerRecord:
    """A peer and all that it shares, as this host's catalogue keeps it."""
    components: list[PeerComponent] = []
    mounts: list[MountPose] = []
    devices: dict[str, str] = {}
    problems: list[Problem] = []
    for key, body in sorted(entries.items()):
        kind, _, name = key.partition("/")
        try:
            match kind:
                case "component" if len(components) >= MOST_COMPONENTS:
                    raise _Wrong(f"more than {MOST_COMPONENTS} components are not taken over")
                case "component":
                    components.append(_component(peer, name, body))
                case "mount":
                    mounts.append(_mount(peer.name, name, body))
                case "device":
                    devices[printable(name)] = peers_id(_text(body, "component"), peer.name)
        except (_Wrong, NondumError) as error:
            told = f"{peer.name} shares what cannot be understood: {error}"
            problems.append(Problem("PEER_ENTRY", told, where=printable(key)))
    return PeerRecord(
        key=peer.key,
        name=peer.name,
        address=peer.address,
        admitted_by=peer.admitted_by,
        life=peer.life,
        components=tuple(components),
        mounts=tuple(mounts),
        devices=devices,
        compute=dict(entries.get("compute", {})),
        problems=tuple(problems),
    )


def claims_of(host: str, entries: Entries) -> Iterator[tuple[str, Claim]]:
    """What components of a peer say is so, each with the key of its entry. What is malformed says
    nothing."""
    for key, body in entries.items():
        kind, _, rest = key.partition("/")
        match kind, body:
            case "fact", {"predicate": str(predicate), "arguments": list(arguments), **more}:
                component = rest.partition("/")[0]
                words = (predicate, *arguments)
                if all(isinstance(w, str) and _WORD.fullmatch(w) for w in words) and _is_value(
                    more.get("value")
                ):
                    id, objects = peers_id(component, host), tuple(arguments)
                    yield key, FactKnown(id, predicate, objects, more.get("value"))
            case "flow", {"component": str(component)} if rest.startswith(f"{host}__"):
                yield key, StreamFlowing(peers_id(component, host), rest, flowing=True)


def withdrawal(claim: Claim) -> FactForgotten | StreamFlowing:
    """The news that a claim is not made any more."""
    if isinstance(claim, FactKnown):
        return FactForgotten(claim.component, claim.predicate, claim.arguments)
    return StreamFlowing(claim.component, claim.stream, flowing=False)


def reach_of(entries: Entries) -> tuple[str, ...]:
    """The IP addresses at which a peer says that its streams can be fetched."""
    hosts = entries.get("reach", {}).get("hosts")
    return tuple(_addresses(hosts)) if isinstance(hosts, list) else ()


def taken_in(host: str, entries: Entries, self_host: str) -> dict[str, str]:
    """Facts about a peer's units and streams that do not hold, since somebody other than this host
    uses them."""
    found: dict[str, str] = {}
    for key, body in entries.items():
        kind, _, text = key.partition("/")
        user = body.get("by")
        if kind == "taken" and isinstance(user, str) and user != self_host:
            predicate, arguments = parts(text) if _FACT.fullmatch(text) else ("", ())
            if predicate in TAKEN_PREDICATES and arguments[0].startswith(f"{host}__"):
                found[text] = printable(user)
    return found


def _addresses(hosts: list[object]) -> Iterator[str]:
    for host in hosts[:MOST_ADDRESSES]:
        try:
            found = ipaddress.ip_address(host) if isinstance(host, str) else None
        except ValueError:
            continue
        if found is not None:
            yield f"[{found}]" if found.version == 6 else str(found)


def _component(peer: Introduced, name: str, body: Mapping[str, Any]) -> PeerComponent:
    if not _ID.fullmatch(name):
        raise _Wrong("its id is no id of a component")
    ready, rank, withheld = body.get("ready"), body.get("rank"), body.get("withheld")
    if not isinstance(ready, bool) or type(rank) is not int:
        raise _Wrong("readiness or rank is missing")
    if not isinstance(withheld, list) or not all(isinstance(unit, str) for unit in withheld):
        raise _Wrong("the list of what is withheld is missing")
    description = PluginDescription.parse(body.get("description"), where=name)
    for behaviour in description.behaviours:
        parse_signature(behaviour.action)  # it raises what is wrong with it
    return PeerComponent(
        id=peers_id(name, peer.name),
        life=peer.life,
        payload_id=_text(body, "payload"),
        version=_text(body, "version"),
        description=description,
        is_ready=ready,
        rank=BELOW_OWN + rank,
        withheld=tuple(withheld),
    )


def _mount(host: str, unit: str, body: Mapping[str, Any]) -> MountPose:
    if not unit.startswith(f"{host}__"):
        raise _Wrong("the unit is not its own")
    return MountPose(unit, _triple(body, "xyz"), _triple(body, "rpy"), "peer")


def _triple(body: Mapping[str, Any], name: str) -> Xyz:
    match body.get(name):
        case [float() | int() as x, float() | int() as y, float() | int() as z] if all(
            math.isfinite(value) for value in (x, y, z)
        ):
            return float(x), float(y), float(z)
    raise _Wrong(f"{name} is not three numbers")


def _text(body: Mapping[str, Any], name: str) -> str:
    text = body.get(name)
    if not isinstance(text, str):
        raise _Wrong(f"{name} is missing")
    return printable(text)


def _is_value(value: object) -> bool:
    if value is None:
        return True
    try:
        value_from_wire(value)
    except MessageInvalid:
        return False
    return True
