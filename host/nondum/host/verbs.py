"""The verbs of the control socket: questions and orders by name."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Any

from nondum.host.control.arguments import Arguments
from nondum.host.control.orders import Orders
from nondum.host.control.questions import Questions
from nondum.host.control.server import Follow, Verb
from nondum.host.control.trust_orders import TrustOrders
from nondum.host.core.plain import Row
from nondum.sdk.errors import ConfigRefused, Problem

if TYPE_CHECKING:  # its import costs ten megabytes, which hosts without peers need not pay
    from nondum.host.peers.peer_services import PeerServices

PEER_VERBS = (
    "peers",
    "peers_certify",
    "peers_confirm",
    "peers_forget",
    "peers_key",
    "peers_refuse",
    "peers_revoke",
    "peers_trust",
    "peers_trust_fleet",
    "peers_why",
    "place",
    "places",
)
"""What a host without peers refuses to answer, and why."""


def answering(
    questions: Questions, orders: Orders, trust: TrustOrders, neighbours: PeerServices | None
) -> dict[str, Verb]:
    """Verbs that answer once."""
    verbs: dict[str, Callable[[Arguments], Awaitable[Any]]] = {
        "behaviours": questions.behaviours,
        "components": questions.components,
        "connect": orders.connect,
        "composition": questions.composition,
        "device_slots": questions.device_slots,
        "devices": questions.devices,
        "devices_why": questions.devices_why,
        "fact": questions.fact,
        "facts": questions.facts,
        "forget": orders.forget,
        "goal": orders.goal,
        "goals": questions.goals,
        "halt": orders.halt,
        "inputs": questions.inputs,
        "journal": questions.journal,
        "known_devices": questions.known_devices,
        "leave_safe_mode": orders.leave_safe_mode,
        "logs": questions.logs,
        "mount": orders.mount,
        "names": questions.names,
        "plan": questions.plan,
        "resume": orders.resume,
        "retry": orders.retry,
        "say": orders.say,
        "status": questions.status,
        "store": questions.store,
        "streams": questions.streams,
        "tap": orders.tap,
        "tree": questions.tree,
        "uninstall": orders.uninstall,
        "units": questions.units,
        "why": questions.why,
        **trust.answering(),
    }
    verbs |= neighbours.answering() if neighbours else dict.fromkeys(PEER_VERBS, _no_peers)
    return {name: _parsing(verb) for name, verb in verbs.items()}


def following(
    questions: Questions, orders: Orders, neighbours: PeerServices | None
) -> dict[str, Follow]:
    """Verbs that go on answering."""
    verbs: dict[str, Callable[[Arguments], AsyncIterator[Any]]] = {
        "follow_facts": questions.follow_facts,
        "follow_goal": questions.follow_goal,
        "follow_goals": questions.follow_goals,
        "follow_journal": questions.follow_journal,
        "follow_logs": questions.follow_logs,
        "follow_tree": questions.follow_tree,
        "install": orders.install,
        "rollback": orders.rollback,
        "watch": questions.watch,
    }
    verbs |= neighbours.following() if neighbours else {"peers_pair": _no_peers_to_follow}
    return {name: _parsing(verb) for name, verb in verbs.items()}


async def _no_peers(arguments: Arguments) -> Any:
    """Answer for a host that has nothing to do with others. Raises `ConfigRefused` (PEERS_OFF)."""
    told = "this host has nothing to do with others"
    raise ConfigRefused(Problem("PEERS_OFF", told, fix="set `enabled = true` under [peers]"))


async def _no_peers_to_follow(arguments: Arguments) -> AsyncIterator[Row]:
    yield await _no_peers(arguments)


def _parsing(verb: Callable[[Arguments], Any]) -> Callable[[Mapping[str, Any]], Any]:
    """The verb, given its arguments as they travel."""
    return lambda given: verb(Arguments(given))
