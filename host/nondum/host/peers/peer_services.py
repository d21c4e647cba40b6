"""All that this host has to do with others, made and tied together; the host's root uses it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Mapping
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.host_config import HostConfig, PeersSection
from nondum.host.control.arguments import Arguments
from nondum.host.core.events.event import Emit, Event
from nondum.host.core.events.facts import UnitsTaken
from nondum.host.core.events.peers import CertificatesBrought
from nondum.host.core.row import Row
from nondum.host.extension.hookspecs import FleetMember, MakeFleet
from nondum.host.jobs.children import Children
from nondum.host.manager.state_folders import Folders
from nondum.host.mind.composition import Composition
from nondum.host.mind.mind import Mind
from nondum.host.peers import asking, translating, trust_orders
from nondum.host.peers.asking import Asking
from nondum.host.peers.compute import Compute, probed
from nondum.host.peers.dispatch import Dispatcher
from nondum.host.peers.finder import PeerFinder
from nondum.host.peers.fleet_transport import listens, own_hosts
from nondum.host.peers.goals import Goals
from nondum.host.peers.name_conflicts import NameConflicts
from nondum.host.peers.offered_entries import Policy, policy_of
from nondum.host.peers.pairing_requests import PairingRequests
from nondum.host.peers.peering import Peering
from nondum.host.peers.placement.pins import Pins
from nondum.host.peers.placement.placement import Placement
from nondum.host.peers.rejected_hosts import RejectedHosts
from nondum.host.peers.remote_calls import AllCalls, RemoteCalls
from nondum.host.peers.serving import Serving
from nondum.host.peers.stream_requests import StreamRequests
from nondum.host.peers.streams.bridge import Bridge, with_port
from nondum.host.peers.translating import Translating
from nondum.host.peers.trust_orders import TrustOrders
from nondum.host.peers.trust_store import PeerTrustStore
from nondum.host.peers.uses import uses_of
from nondum.host.peers.view import PeersView
from nondum.host.people.conversation import Reply
from nondum.host.people.stopping import Stopped
from nondum.host.workers.workers import Workers
from nondum.transport.discovery import Hint
from nondum.transport.fleet import FleetEvent, Mesh
from nondum.transport.peers import (
    LinksFailed,
    PeerLost,
    PeerRefused,
    PeerUp,
    Refusal,
    Security,
    Trust,
)

log = logging.getLogger(__name__)


class PeerServices:
    """`await open(…)` it, then `start`; `close` it before the workers."""

    def __init__(
        self,
        config: HostConfig,
        make_fleet: MakeFleet,
        trust_store: PeerTrustStore,
        workers: Workers,
        catalogue: Catalogue,
        emit: Emit,
        compute: Compute,
        mind: Callable[[], Mind],
        stop: Callable[[], Stopped],
        answer: Reply,
        placement: Placement,
        bridge: Bridge,
    ) -> None:
        """Use `open`. `mind` is asked for once the host runs; `stop` stops this host, `answer`
        answers what is asked about it."""
        self.trust_store = trust_store
        self._tasks: set[asyncio.Task[None]] = set()
        self._troubles: list[str] = []
        self._listens = listens(config.peers)
        self._host, self._emit, self._mind = config.host.name, emit, mind
        self._movable = frozenset(config.peers.offer_actuators)
        self.requests = Dispatcher()
        self._make_serving(workers, catalogue)
        self._make_fleet(config, make_fleet, workers, catalogue, compute)
        self.view = self._made_view(catalogue)
        self._streams = StreamRequests(
            bridge, workers.streams, self.peering, self.fleet, self._hints
        )
        self._streams.serve(self.requests)
        self.trust = self._made_trust_orders(is_development=config.peers.development)
        self._make_goals(config, stop, answer)
        self.placement = placement
        placement.serve(self.requests)
        self._remote = RemoteCalls(self.peering, emit, self.peering.claims)
        self.calls = AllCalls(workers, self._remote)

    def _make_serving(self, workers: Workers, catalogue: Catalogue) -> None:
        """What peers may have carried out here."""
        self.serving = Serving(
            workers,
            catalogue.snapshot,
            self._composition,
            self._policy,
            self._own_uses,
            self._on_taken,
        )
        self.requests.add("behave", self.serving.behave, self.serving.orphaned)
        self.requests.hear("values", self.serving.values)

    def _make_fleet(
        self,
        config: HostConfig,
        make_fleet: MakeFleet,
        workers: Workers,
        catalogue: Catalogue,
        compute: Compute,
    ) -> None:
        """The other hosts, how they are found, and what is shared with them."""
        host, own = config.host.name, self._own_uses
        clock = asyncio.get_running_loop().time
        self._strangers = RejectedHosts(self._emit, clock)
        self._name_conflicts = NameConflicts(host, clock, self._hints)
        self.finder: PeerFinder | None = None
        member = FleetMember(
            self.trust_store.identity(development=config.peers.development),
            self.trust_store.trust,
            self.requests,
            on_event=self._on_fleet,
            find=lambda mesh: self._find(mesh, config.peers),
        )
        self.fleet = make_fleet(member)
        self.peering = Peering(
            host,
            self.fleet,
            self._emit,
            snapshot=catalogue.snapshot,
            policy=self._policy,
            claims=workers.claims,
            taken=lambda: {**dict.fromkeys(own(), host), **self.serving.taken},
            about={"compute": compute, "reach": {"hosts": list(own_hosts(config))}},
        )

    def _made_view(self, catalogue: Catalogue) -> PeersView:
        return PeersView(
            security=self.fleet.security,
            snapshot=catalogue.snapshot,
            peers=lambda: self.fleet.peers,
            trust=lambda: self.trust_store.trust,
            hints=self._hints,
            network=lambda: self.finder.status if self.finder else None,
            refusals=self.fleet.refusals,
            problems=lambda: self.fleet.problems,
            links_pid=lambda: self.fleet.links_pid if isinstance(self.fleet, Mesh) else None,
        )

    def _made_trust_orders(self, *, is_development: bool) -> TrustOrders:
        pairing = PairingRequests(
            self.trust_store,
            announce=self._announce_pairing,
            candidates=self._hints,
            known=lambda: {peer.key: peer.name for peer in self.fleet.peers.values()},
            is_development=is_development,
        )
        return TrustOrders(self.trust_store, pairing, self.view.known)

    def _make_goals(self, config: HostConfig, stop: Callable[[], Stopped], answer: Reply) -> None:
        """Goals that people give here for peers, and there for this host; questions likewise."""
        names, accepts = self.peering.names, config.peers.accept_goals
        translator = Translating(
            self._mind, self.peering, names, deadline_s=config.planning.translate_s
        )
        self.goals = Goals(
            self._host, self._mind, self.peering, names, stop, translator.ask, accepts=accepts
        )
        self.asking = Asking(self.peering, names, answer)
        self.requests.add(asking.METHOD, self.asking.serve)
        self.requests.add(translating.METHOD, translator.serve)
        self.requests.add("goal.ask", self.goals.serve_ask)
        self.requests.add("goal.give", self.goals.serve_give)
        self.requests.add("goal.again", self.goals.serve_again)
        self.requests.hear("goal.news", self.goals.hear_news)
        self.requests.hear("goal.standing", self.goals.on_goal_status)

    @classmethod
    async def open(
        cls,
        config: HostConfig,
        make_fleet: MakeFleet,
        folders: Folders,
        workers: Workers,
        catalogue: Catalogue,
        emit: Emit,
        mind: Callable[[], Mind],
        stop: Callable[[], Stopped],
        answer: Reply,
        children: Children,
        judged_by: Callable[[str], Awaitable[Mapping[str, Any]]],
    ) -> PeerServices:
        """Read keys and trust, and look at this machine; `judged_by` is what payloads are judged by
        now. Raises `PeerRefused`."""
        made: PeerServices
        trust_store = await PeerTrustStore.open(
            folders.peers,
            config.host.name,
            on_change=lambda trust: made._on_trust(trust),
            on_certificate=lambda certificate: made._on_certificate(certificate),
        )
        compute = await asyncio.to_thread(_compute, config)
        placement = Placement(
            *(config, folders, children, catalogue, emit),
            lambda: made.fleet,
            pins=await Pins.open(folders.root / "places.json"),
            compute=compute,
            confinement=workers.launcher.level,
            judged_by=judged_by,
            known=lambda: made.view.known().values(),
        )
        bridge = Bridge(children.forks, listens(config.peers), port=config.peers.stream_port)
        made = cls(
            *(config, make_fleet, trust_store, workers, catalogue, emit, compute),
            *(mind, stop, answer, placement, bridge),
        )
        return made

    @property
    def warnings(self) -> tuple[str, ...]:
        """What every status says of it."""
        is_open = self.fleet.security is Security.DEVELOPMENT
        unsafe = ("peers need no keys: every host on this machine is one",) if is_open else ()
        own = self.finder.identity_problem if self.finder else None
        problems = (
            *self.fleet.problems,
            *self.trust_store.warnings,
            *self._name_conflicts.problems,
            *((own,) if own else ()),
        )
        return (*unsafe, *map(str, problems), *self._troubles)

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
        await self.goals.close()
        await self._remote.close()
        await self._streams.close()
        await self.fleet.close()

    def _on_certificate(self, certificate: bytes) -> None:
        if isinstance(self.fleet, Mesh):  # by way of a router, no peer asks for it
            self.fleet.show_certificate(certificate)

    def _on_trust(self, trust: Trust) -> None:
        self.fleet.set_trust(trust)
        if self.finder is not None:
            self.finder.tell_again()

    def _on_fleet(self, event: FleetEvent) -> None:
        self.view.on_fleet(event)
        self._name_conflicts.on_fleet(event)
        match event:
            case Refusal():
                self._strangers.turned_away(event)
            case LinksFailed(problem):
                log.warning("%s", problem)
                self._mind().people.tell(str(problem))
        self.peering.on_fleet(event)
        match event:
            case PeerUp():
                self._aside(self._streams.expect())
            case PeerLost():
                self._streams.lose(event.key)

    async def _look_at(self, event: CertificatesBrought) -> None:
        """Take this host's certificate, if a drive brought it, and is of use."""
        for data in event.certificates:
            try:
                taken = await self.trust_store.offer(data.encode("ascii"))
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
        return policy_of(self._composition(), self._movable)

    def _own_uses(self) -> frozenset[str]:
        return uses_of(self._mind().runner)

    def _on_taken(self) -> None:
        self._emit(UnitsTaken(self._host, self.serving.taken))


def _compute(config: HostConfig) -> Compute:
    reserve_mb = config.install.reserve_mb
    return probed(config.host.state, reserve_mb=reserve_mb) | {"place": config.peers.place}
