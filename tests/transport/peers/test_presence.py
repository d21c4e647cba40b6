"""Peers that are late, hosts whose own loop stood still, and what others say."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from dataclasses import dataclass

import pytest
import zmq
from tests.kit.clock import VirtualClock
from tests.kit.until import until_async
from tests.transport.peers.bad_ends import bad_dealer, hello_of
from tests.transport.peers.connections import Accepted
from tests.transport.peers.hosts import PATIENCE_S, Host, host, identity, trusting, two_hosts, up

from nondum.transport.peers import DialFailed, HostKeys, Loss, PeerLost, PeerUp, Reason, peer_table
from nondum.transport.peers.accepted import AWAITED_S
from nondum.transport.peers.dial import ANSWER_S, GREETING_S
from nondum.transport.peers.drained import Sent
from nondum.transport.peers.link import Link
from nondum.transport.peers.messages import Ask, Bye, Ping, Pong, encode
from nondum.transport.peers.presence import Presence
from nondum.transport.peers.pulse import Pulse
from nondum.transport.peers.session import Session
from nondum.transport.peers.suspicion import Terms

pytestmark = pytest.mark.anyio

TERMS = Terms()
BEAT_S = 0.3
STEP_S = 0.05


async def test_host_after_a_stall_of_its_loop_gives_no_peer_up(clock: VirtualClock) -> None:
    async with two_hosts() as (rover, base):
        await clock.advance(1.0)
        for stall_s in (1.0, 5.0, 3600.0):
            call = rover.node.call(base.key, "echo", {"stall": stall_s}, deadline_s=7200)
            await clock.stand_still(stall_s)
            assert await call == {"stall": stall_s}
            await talk((rover, base), (base, rover))
        assert not lost(rover)
        assert not lost(base)
        assert len(base.servant.served) == 3


async def test_answer_from_before_another_stall_does_not_show_that_the_link_lasts(
    clock: VirtualClock,
) -> None:
    """The peer may have given the link up after it had answered."""
    async with two_hosts() as (rover, base):
        real = rover.node._peer_table.session(base.key)
        session = Session(real.admission, real.known, rover.servant, Pulse(), lambda _: None)
        link = Link(Wire(), base.key, clock.time(), dialled=True)
        session.join(link)
        pings: list[int] = []
        presence = Presence(
            TERMS, {base.key: session}, lambda link, n: _ping(link, n, pings), lambda _: None
        )
        presence.joined(link, BEAT_S)
        presence.doubt(session)
        for speaks_first in (True, False):
            await clock.stand_still(10.0)
            if speaks_first:
                link.tell(Ping(1))
            presence.take_in(session, link, Pong(pings[-1]))
            assert session.doubt is not None
        assert len(pings) == len(set(pings)) == 3
        presence.take_in(session, link, Pong(pings[-1]))
        assert session.doubt is None
        assert not link.is_doubtful(clock.time())


async def test_host_that_stands_still_as_it_greets_doubts_the_link(clock: VirtualClock) -> None:
    class Stalling(Wire):
        def send(self, data: bytes) -> Sent:
            """Send, and stand still before anything else is done."""
            clock.skip(10.0)
            return Sent.SENT

    link = Link(Stalling(), None, clock.time(), dialled=False)
    link.tell(Ping(1))
    link.doubt_s = TERMS.doubt_s(BEAT_S)
    assert link.is_doubtful(clock.time())


@pytest.mark.parametrize(
    ("before", "stall_s"),
    [(0, 0.0), (0, 2.0), (200, 0.0), (200, 2.0)],
    ids=["alone", "after a stall", "behind others", "behind others after a stall"],
)
async def test_goodbye_counts_that_waits_to_be_read_when_its_connection_is_found_gone(
    clock: VirtualClock, before: int, stall_s: float
) -> None:
    faults: list[object] = []
    clock.set_exception_handler(lambda _, context: faults.append(context))
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there:
        with bad_dealer(there.address, rover, there) as leaving:
            leaving.send(hello_of(rover))
            await there.told(PeerUp)
            connections = Accepted(int(there.address.rpartition(":")[2]))

            def leave_while_nothing_is_read() -> None:
                for _ in range(before):
                    leaving.send(encode(Ping(9)))
                leaving.send(encode(Bye("closed")))
                leaving.close(linger=int(PATIENCE_S) * 1000)
                connections.until_closed()

            clock.call_later(0.99 * BEAT_S, leave_while_nothing_is_read)
            clock.skip(BEAT_S + stall_s)  # so that base's ping comes next, before it reads
            lost = await clock.advance_until(there.told(PeerLost))
            assert lost.reason is Loss.DEPARTED
            assert not faults


def _ping(link: Link, number: int, pings: list[int]) -> None:
    pings.append(number)
    link.tell(Ping(1))


class Wire:
    """Takes everything, and leads nowhere."""

    address = "nowhere"

    def send(self, data: bytes) -> Sent:
        """Send without waiting."""
        return Sent.SENT

    def drain(self) -> bool:
        """Nothing ever comes."""
        return True

    def cut(self, linger_ms: int = 0) -> None:
        """End the connection."""


async def test_late_peer_that_another_peer_reaches_has_the_same_time_once_more(
    clock: VirtualClock,
) -> None:
    async with three_hosts() as (fleet, cables):
        cables.rover_base.break_silently()
        alone_s, helped_s = TERMS.limit_s(BEAT_S), TERMS.confirm_s(BEAT_S)
        found_s = await silence_of_base(fleet, clock)
        assert alone_s + helped_s - BEAT_S - STEP_S <= found_s <= alone_s + helped_s + STEP_S


async def test_late_peer_that_sends_again_is_not_given_up(clock: VirtualClock) -> None:
    async with three_hosts() as (fleet, cables):
        cables.rover_base.break_silently()
        for _ in range(24):
            await clock.advance(STEP_S)
            await talk(*fleet.ring)
        assert not lost(fleet.rover)
        cables.rover_base.mend()
        await talk((fleet.rover, fleet.base), (fleet.base, fleet.rover))
        for _ in range(60):
            await clock.advance(STEP_S)
            await talk(*fleet.ring, (fleet.rover, fleet.base), (fleet.base, fleet.rover))
        assert not lost(fleet.rover)
        assert not lost(fleet.base)


async def test_peer_that_no_other_hears_is_given_up_at_the_limit(clock: VirtualClock) -> None:
    async with three_hosts() as (fleet, cables):
        cables.rover_base.break_silently()
        cables.scout_base.break_silently()
        found_s = await silence_of_base(fleet, clock, base_is_dead=True)
        assert found_s <= TERMS.limit_s(BEAT_S) + STEP_S < 1.5


async def test_peer_of_an_older_version_is_not_asked(
    clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(peer_table, "VERSIONS", (1,))
    async with three_hosts() as (fleet, cables):
        cables.rover_base.break_silently()
        assert await silence_of_base(fleet, clock) <= TERMS.limit_s(BEAT_S) + STEP_S
        assert not fleet.scout.node.refusals.counts


async def test_question_that_the_agreed_version_has_not_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(peer_table, "VERSIONS", (1,))
    async with two_hosts() as (rover, base):
        say(rover, base, Ask(1, rover.key))
        await base.counted(Reason.GARBAGE)
        assert (await rover.told(PeerLost)).reason is Loss.TURNED_AWAY


async def test_question_about_an_unknown_host_or_about_oneself_is_ignored() -> None:
    async with two_hosts() as (rover, base):
        for about in ("nowhere", rover.key, base.key):
            say(rover, base, Ask(1, about))
        await talk((rover, base), (base, rover))
        assert not base.node.refusals.counts


async def test_connection_is_not_cut_for_time_in_which_the_host_stood_still(
    clock: VirtualClock,
) -> None:
    async with host(identity("base")) as there:
        await clock.advance(1.0)
        with socket.create_connection(("127.0.0.1", int(there.address.rpartition(":")[2]))):
            await until_async("a stranger", lambda: there.node.strangers == 1)
            for _ in range(3):
                await clock.stand_still(60.0)
                await clock.advance(BEAT_S)
            assert there.node.strangers == 1
            await clock.advance(AWAITED_S)
            assert there.node.refusals.counts == {Reason.SILENT: 1}


async def test_host_that_has_let_in_a_connection_may_be_slow_to_greet(clock: VirtualClock) -> None:
    base = HostKeys.generate()
    with zmq.Context() as context, context.socket(zmq.ROUTER) as slow:
        slow.curve_server, slow.curve_secretkey, slow.linger = True, base.secret.encode(), 0
        address = f"tcp://127.0.0.1:{slow.bind_to_random_port('tcp://127.0.0.1')}"
        async with host(identity("rover"), trusting(identity("base", base))) as rover:
            rover.node.dial(base.public, [address])
            await asyncio.to_thread(slow.recv_multipart)  # its greeting
            await clock.advance(ANSWER_S + 1.0)
            assert rover.events.empty()
            await clock.advance(GREETING_S)
            assert (await rover.told(DialFailed)).problem.code == "PEER_SILENT"


@dataclass
class Fleet:
    rover: Host
    scout: Host
    base: Host

    @property
    def ring(self) -> tuple[tuple[Host, Host], ...]:
        """Sender and receiver, in order: a question on this way is answered before the way ends."""
        return (
            (self.rover, self.scout),
            (self.scout, self.base),
            (self.base, self.scout),
            (self.scout, self.rover),
        )


@dataclass
class Cables:
    rover_base: Cable
    scout_base: Cable


class Cable:
    """A TCP connection in two parts, which can stop to carry anything without an end of it."""

    def __init__(self, to: str) -> None:
        self._to = int(to.rpartition(":")[2])
        self._is_whole = asyncio.Event()
        self._is_whole.set()
        self._carrying: set[asyncio.Task[None]] = set()
        self._ends: list[asyncio.StreamWriter] = []

    async def __aenter__(self) -> Cable:
        self._server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        self.address = f"tcp://127.0.0.1:{self._server.sockets[0].getsockname()[1]}"
        return self

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        for one in self._carrying:
            one.cancel()
        await asyncio.gather(*self._carrying, return_exceptions=True)
        for end in self._ends:
            end.close()
        await asyncio.gather(*(end.wait_closed() for end in self._ends), return_exceptions=True)

    def break_silently(self) -> None:
        self._is_whole.clear()

    def mend(self) -> None:
        self._is_whole.set()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._ends.append(writer)
        there = await asyncio.open_connection("127.0.0.1", self._to)
        self._ends.append(there[1])
        for source, drain in ((reader, there[1]), (there[0], writer)):
            self._carrying.add(asyncio.ensure_future(self._carry(source, drain)))

    async def _carry(self, source: asyncio.StreamReader, drain: asyncio.StreamWriter) -> None:
        with contextlib.closing(drain), contextlib.suppress(ConnectionError):
            while data := await source.read(65536):
                await self._is_whole.wait()
                drain.write(data)


@contextlib.asynccontextmanager
async def three_hosts() -> AsyncIterator[tuple[Fleet, Cables]]:
    """Each linked to the others; what leads to the base can be cut."""
    names = [identity(name) for name in ("rover", "scout", "base")]
    async with contextlib.AsyncExitStack() as stack:
        rover, scout, base = [
            await stack.enter_async_context(host(me, trusting(*(o for o in names if o is not me))))
            for me in names
        ]
        cables = Cables(
            await stack.enter_async_context(Cable(base.address)),
            await stack.enter_async_context(Cable(base.address)),
        )
        rover.node.dial(scout.key, [scout.address])
        rover.node.dial(base.key, [cables.rover_base.address])
        scout.node.dial(base.key, [cables.scout_base.address])
        for one, other in ((rover, scout), (rover, base), (scout, base)):
            await up(one, other)
        yield Fleet(rover, scout, base), cables


async def talk(*pairs: tuple[Host, Host]) -> None:
    """Have one host after the other tell something, and wait until it has arrived."""
    for teller, hearer in pairs:
        teller.node.notify(hearer.key, "values", {})
        while (await asyncio.wait_for(hearer.servant.notices.get(), PATIENCE_S))["from"] != (
            teller.node.identity.name
        ):
            pass


async def silence_of_base(
    fleet: Fleet, clock: VirtualClock, *, base_is_dead: bool = False
) -> float:
    """How long it took the rover to give the base up, from now on."""
    pairs = [pair for pair in fleet.ring if not (base_is_dead and fleet.base in pair)]
    began_s = clock.time()
    while not (found := lost(fleet.rover)):
        await clock.advance(STEP_S)
        await talk(*pairs)
        assert clock.time() - began_s < PATIENCE_S
    assert (found[0].key, found[0].reason) == (fleet.base.key, Loss.SILENT)
    return clock.time() - began_s


def lost(one: Host) -> list[PeerLost]:
    """The losses that a host has told so far."""
    told = [one.events.get_nowait() for _ in range(one.events.qsize())]
    return [event for event in told if isinstance(event, PeerLost)]


def say(teller: Host, hearer: Host, message: Ask) -> None:
    """Send a message as it is, as a hostile host might."""
    teller.node._peer_table.session(hearer.key).send(encode(message))
