"""All that this host has to do with others, made and tied together; the host's root uses it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Iterator
from typing import TYPE_CHECKING, Any

from nondum.host.bridge.bridge import Bridge, with_port
from nondum.host.bridge.remote_streams import RemoteStreams
from nondum.host.bridge.shared_streams import SharedStreams
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config import HostConfig, PeersSection
from nondum.host.control.arguments import Arguments
from nondum.host.events import CertificatesBrought, Emit, Event, UnitsTaken
from nondum.host.lifecycle.children import Children
from nondum.host.lifecycle.folders import Folders
from nondum.host.mind.composition import Composition
from nondum.host.mind.mind import Mind
from nondum.host.peers import trust_orders
from nondum.host.peers.compute import Compute, probed
from nondum.host.peers.desk import Desk
from nondum.host.peers.finder import PeerFinder
from nondum.host.peers.goals import Goals
from nondum.host.peers.heard import reach_of
from nondum.host.peers.offered import Policy
from nondum.host.peers.pairing_desk import PairingDesk
from nondum.host.peers.peering import Peering
from nondum.host.peers.placement.pins import Pins
from nondum.host.peers.placement.placement import Placement
from nondum.host.peers.remote_calls import AllCalls, RemoteCalls, is_peers
from nondum.host.peers.serving import Serving
from nondum.host.peers.strangers import Strangers
from nondum.host.peers.trust_keeper import TrustKeeper
from nondum.host.peers.trust_orders import TrustOrders
from nondum.host.peers.view import PeersView
from nondum.host.rows import Row
from nondum.host.workers.workers import Workers
from nondum.planning.core import TAKEN_PREDICATES
from nondum.planning.facts import predicate_of
from nondum.sdk.description import ACTUATORS
from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.discovery import Hint
from nondum.transport.discovery import interfaces as network
from nondum.transport.fleet import FleetEvent, Mesh
from nondum.transport.peers import (
    CallFailed,
    Errand,
    PeerLost,
    PeerRefused,
    Refusal,
    Security,
    Trust,
)

if TYPE_CHECKING:  # zenoh is an extra
    from nondum.transport.fleet.zenoh import ZenohFleet

ON_LOOPBACK = ("tcp://127.0.0.1:0",)
OPEN_S = 10.0
"""What a peer has to open a stream."""


class Neighbourhood:
    """`await open(…)` it, then `start`; `close` it before the workers."""

    def __init__(
        self,
        config: HostConfig,
        keeper: TrustKeeper,
        workers: Workers,
        catalogue: Catalogue,
        emit: Emit,
        compute: Compute,
        mind: Callable[[], Mind],
        placement: Placement,
    ) -> None:
        """Use `open`. `mind` is asked for once the host runs."""
        host = config.host.name
        self.keeper = keeper
        self._tasks: set[asyncio.Task[None]] = set()
        self._troubles: list[str] = []
        self._listens = _listen(config.peers)
        self._host, self._emit, self._mind = host, emit, mind
        self._movable = frozenset(config.peers.offer_actuators)
        self.serving = Serving(
            workers,
            catalogue.snapshot,
            self._composition,
            self._policy,
            self._own_uses,
            self._on_taken,
        )
        self._strangers = Strangers(emit, asyncio.get_running_loop().time)
        self.desk = Desk()
        self.desk.add("behave", self.serving.behave, self.serving.orphaned)
        self.desk.hear("values", self.serving.values)
        self.finder: PeerFinder | None = None
        self.fleet = self._fleet(config)
        self.peering = Peering(
            host,
            self.fleet,
            emit,
            snapshot=catalogue.snapshot,
            policy=self._policy,
            claims=workers.claims,
            taken=lambda: {**dict.fromkeys(self._own_uses(), host), **self.serving.taken},
            about={"compute": compute, "reach": {"hosts": list(_own_hosts(config))}},
        )
        self.view = PeersView(
            security=self.fleet.security,
            snapshot=catalogue.snapshot,
            peers=lambda: self.fleet.peers,
            trust=lambda: keeper.trust,
            hints=self._hints,
            network=lambda: self.finder.status if self.finder else None,
            refusals=self.fleet.refusals,
        )
        self._bridge = Bridge(self._listens, port=config.peers.stream_port)
        self._shared = SharedStreams(self._bridge, workers.streams)
        self._remote_streams = RemoteStreams(self._bridge, self._ask, self._addresses)
        workers.streams.reach(self._remote_streams)
        self.desk.add("stream.open", self._open_stream)
        self.desk.add("stream.close", self._close_stream)
        self.trust = TrustOrders(
            keeper,
            PairingDesk(
                keeper,
                announce=self._announce_pairing,
                candidates=self._hints,
                is_development=config.peers.development,
            ),
            self.view.known,
        )
        self.goals = Goals(
            host,
            mind,
            self.peering,
            self.peering.names,
            accepts=config.peers.accept_goals,
        )
        self.desk.add("goal.ask", self.goals.serve_ask)
        self.desk.add("goal.give", self.goals.serve_give)
        self.desk.hear("goal.news", self.goals.hear_news)
        self.placement = placement
        placement.serve(self.desk)
        self._remote = RemoteCalls(self.peering, emit, self.peering.claims)
        self.calls = AllCalls(workers, self._remote)

    @classmethod
    async def open(
        cls,
        config: HostConfig,
        folders: Folders,
        workers: Workers,
        catalogue: Catalogue,
        emit: Emit,
        mind: Callable[[], Mind],
        children: Children,
    ) -> Neighbourhood:
        """Read keys and trust, and look at this machine. Raises `PeerRefused`."""
        keeper = await TrustKeeper.open(
            folders.peers,
            config.host.name,
            on_change=lambda trust: made._on_trust(trust),
            on_certificate=lambda certificate: made._on_certificate(certificate),
        )
        compute = await asyncio.to_thread(
            probed, config.host.state, reserve_mb=config.install.reserve_mb
        )
        compute["place"] = config.peers.place
        placement = Placement(
            config,
            folders,
            children,
            catalogue,
            emit,
            lambda: made.fleet,
            pins=await Pins.open(folders.root / "places.json"),
            compute=compute,
            confinement=workers.launcher.level,
            known=lambda: made.view.known().values(),
        )
        made = cls(config, keeper, workers, catalogue, emit, compute, mind, placement)
        return made

    @property
    def warnings(self) -> tuple[str, ...]:
        """What every status says of it."""
        is_open = self.fleet.security is Security.DEVELOPMENT
        unsafe = ("peers need no keys: every host on this machine is one",) if is_open else ()
        return (*unsafe, *map(str, self.keeper.warnings), *self._troubles)

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        own = {"peers": self.view.rows, "peers_why": self.view.why}
        return {**own, **trust_orders.answering(self.trust), **self.placement.answering()}

    def following(self) -> dict[str, Callable[[Arguments], AsyncIterator[Row]]]:
        """Verbs that go on answering."""
        return trust_orders.following(self.trust)

    async def start(self) -> None:
        """Be there for peers. Raises `PeerRefused`.

        Where the port is taken, another one is used: multicast tells it, but hosts that look for
        this one by name do not find it, so people are warned.
        """
        try:
            await self.fleet.start()
        except PeerRefused as refused:
            if refused.code != "ADDRESS_UNUSABLE" or not isinstance(self.fleet, Mesh):
                raise
            self._troubles.append(str(refused.problems[0]))
            self._mind().people.tell(f"{refused.problems[0]}; this host listens elsewhere")
            self.fleet.listen_at([with_port(address, 0) for address in self._listens])
            await self.fleet.start()

    def on_event(self, event: Event) -> None:
        """Take in what happens on this host."""
        if isinstance(event, CertificatesBrought):
            self._aside(self._look_at(event))
        self.serving.on_event(event)
        self.peering.on_event(event)
        self.goals.on_event(event)
        self.placement.on_event(event)

    async def close(self) -> None:
        """Say goodbye; what runs for peers, and at peers, is halted."""
        await self.placement.close()
        await self._remote.close()
        await self._remote_streams.close()
        await self._bridge.close()
        await self.fleet.close()

    def _fleet(self, config: HostConfig) -> Mesh | ZenohFleet:
        """By a router, where there is one; else a link to each. Raises `PeerRefused`."""
        identity = self.keeper.identity(development=config.peers.development)
        trust, router = self.keeper.trust, config.router
        if router.endpoints:
            from nondum.transport.fleet.zenoh import ZenohFleet
            from nondum.transport.fleet.zenoh_line import RouterAccess

            access = RouterAccess(
                router.fleet,
                router.endpoints,
                router.authorities,
                router.certificate,
                router.private_key,
            )
            return ZenohFleet(identity, trust, self.desk, access, on_event=self._on_fleet)
        return Mesh(
            identity,
            trust,
            self.desk,
            on_event=self._on_fleet,
            listen=self._listens,
            find=lambda mesh: self._find(mesh, config.peers),
        )

    def _on_certificate(self, certificate: bytes) -> None:
        if isinstance(self.fleet, Mesh):  # by way of a router, nobody asks for it
            self.fleet.show_certificate(certificate)

    def _on_trust(self, trust: Trust) -> None:
        self.fleet.set_trust(trust)
        if self.finder is not None:
            self.finder.tell_again()

    def _on_fleet(self, event: FleetEvent) -> None:
        self.view.on_fleet(event)
        if isinstance(event, Refusal):
            self._strangers.turned_away(event)
        self.peering.on_fleet(event)
        if isinstance(event, PeerLost):
            self._aside(self._shared.caller_lost(event.key))

    async def _look_at(self, event: CertificatesBrought) -> None:
        """Take this host's certificate, if a drive brought it, and is of use."""
        for data in event.certificates:
            try:
                taken = await self.keeper.offer(data.encode("ascii"))
            except PeerRefused as refused:
                self._mind().people.tell(f"drive {event.drive}: {refused.problems[0]}")
                return
            if taken is not None:
                day = taken.not_after.date().isoformat()
                told = f"drive {event.drive} has brought this host's certificate, good until {day}"
                self._mind().people.tell(told)

    def _aside(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # Streams

    async def _open_stream(self, errand: Errand) -> Body:
        """Let a peer read a stream of an offered unit. Raises `CallFailed` (NOT_OFFERED)."""
        if errand.args.get("stream") not in self.peering.offered_streams():
            told = "no such stream is offered to peers"
            raise CallFailed(Problem("NOT_OFFERED", told))
        return await self._shared.serve_open(errand.caller.key, errand.args)

    async def _close_stream(self, errand: Errand) -> Body:
        return await self._shared.serve_close(errand.caller.key, errand.args)

    async def _ask(self, host: str, method: str, args: Body) -> Body:
        return await self.peering.call(host, method, args, deadline_s=OPEN_S)

    def _addresses(self, host: str) -> tuple[str, ...]:
        """Where a peer is reached now; none for a host that is no peer."""
        key = self.peering.key_of(host)
        peer = self.fleet.peers.get(key) if key else None
        if key is None or peer is None:
            return ()
        hinted = (
            address for hint in self._hints() if hint.key == key for address in hint.addresses
        )
        told = (f"tcp://{one}:0" for one in reach_of(peer.entries))
        own = (_as_endpoint(peer.address),) if _has_port(peer.address) else ()
        return tuple(dict.fromkeys((*own, *hinted, *told)))

    def _hints(self) -> tuple[Hint, ...]:
        return self.finder.hints if self.finder else ()

    def _announce_pairing(self, port: int | None) -> None:
        if self.finder is not None:
            self.finder.announce_pairing(port)

    def _find(self, mesh: Mesh, config: PeersSection) -> PeerFinder:
        self.finder = PeerFinder(mesh, config)
        return self.finder

    def _composition(self) -> Composition | None:
        return self._mind().composition

    def _policy(self) -> Policy:
        composition = self._composition()
        if composition is None:
            return Policy(self._movable)
        types = composition.merged.domain.types
        moving = (name for name in types.parents if types.is_one_of((name,), ACTUATORS))
        return Policy(self._movable, ACTUATORS | frozenset(moving))

    def _own_uses(self) -> frozenset[str]:
        """The facts that this host's own behaviours take of its own components."""
        return frozenset(
            text
            for run in self._mind().runner
            if not is_peers(run.component)
            for text in run.step.delete
            if predicate_of(text) in TAKEN_PREDICATES
        )

    def _on_taken(self) -> None:
        self._emit(UnitsTaken(self._host, self.serving.taken))


def _own_hosts(config: HostConfig) -> Iterator[str]:
    """Where this host's streams can be fetched, as it is started; links tell that by themselves."""
    if config.router.endpoints:
        every = network.read()
        local = config.peers.development
        for one in network.loopback(every) if local else network.looked_on(every):
            yield from one.hosts


def _has_port(address: str) -> bool:
    return address.rpartition(":")[2].isdigit()


def _as_endpoint(address: str) -> str:
    """Where a peer is, whether it was dialled (`tcp://HOST:PORT`) or has dialled (`HOST:PORT`)."""
    return address if address.startswith("tcp://") else f"tcp://{address}"


def _listen(config: PeersSection) -> tuple[str, ...]:
    is_default = config.listen == PeersSection().listen
    return ON_LOOPBACK if config.development and is_default else config.listen
