"""Pairing over the network: two hosts, their people, and attackers between them."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

import pytest
import zmq
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left
from tests.kit.examples import a_share
from tests.kit.until import until_async
from tests.transport.peers.bad_ends import bad_router
from tests.transport.peers.connections import Accepted
from tests.transport.peers.held_back import held_back
from tests.transport.peers.hosts import PATIENCE_S, identity

from nondum.sdk.errors import NondumError
from nondum.transport.peers import (
    HostKeys,
    Identity,
    PeerKey,
    PeerRefused,
    Reason,
    Refusal,
    fingerprint,
    pairing,
)
from nondum.transport.peers import pairing_channel as channel
from nondum.transport.peers.listener import dialling
from nondum.transport.peers.pairing import TRIES, Ask, Commit, Nonce
from nondum.transport.peers.pairing import Agreed as yes
from nondum.transport.peers.pairing_channel import PairingHost
from nondum.transport.peers.pairing_listener import MOST_SENT
from nondum.transport.peers.pairing_messages import (
    MAX_BYTES,
    Beat,
    Ended,
    Ending,
    Said,
    decode,
    encode,
)
from nondum.transport.peers.pairing_state import (
    Agreed,
    Comparing,
    Failed,
    Idle,
    PairingState,
    Waiting,
)

pytestmark = pytest.mark.anyio

S = TypeVar("S", bound=PairingState)


@dataclass
class End:
    """A host that can be paired, and the person at it."""

    identity: Identity
    host: PairingHost
    port: int = 0
    states: list[PairingState] = field(default_factory=list)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    refused: asyncio.Queue[Refusal] = field(default_factory=asyncio.Queue)

    @property
    def key(self) -> PeerKey:
        return self.identity.key

    @property
    def address(self) -> str:
        return f"tcp://127.0.0.1:{self.port}"

    def hear(self, state: PairingState) -> None:
        self.states.append(state)
        self.news.set()

    async def sees(
        self, kind: type[S], holds: Callable[[S], bool] = lambda state: True, since: int = 0
    ) -> S:
        """Wait until the host is, or was, in a state; the first `since` states do not count."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for state in self.states[since:]:
                    if isinstance(state, kind) and holds(state):
                        return state
                self.news.clear()
                await self.news.wait()

    async def fails(self) -> str:
        """Wait for the end, and give its code."""
        return (await self.sees(Failed)).problem.code

    async def gives_up(self, code: str) -> Waiting:
        """Wait until a try came to nothing for a reason, and the window is still open."""
        return await self.sees(
            Waiting, lambda state: state.problem is not None and state.problem.code == code
        )

    async def turns_away(self, *reasons: Reason) -> None:
        """Wait until a host was turned away for one of these reasons."""
        async with asyncio.timeout(PATIENCE_S):
            while (await self.refused.get()).reason not in reasons:
                pass

    def asks(self, other: End) -> None:
        self.host.ask(other.key, [other.address])

    def says_yes(self) -> None:
        assert isinstance(self.host.state, Comparing)
        self.host.confirm(self.host.state.code)


@contextlib.asynccontextmanager
async def end(
    me: Identity | str,
    is_wanted: Callable[[PeerKey, str], bool] = lambda key, name: True,
    holder: Callable[[str], PeerKey | None] = lambda name: None,
) -> AsyncIterator[End]:
    """A host whose person has opened the window."""
    me = identity(me) if isinstance(me, str) else me
    host = PairingHost(
        me,
        lambda state: found.hear(state),
        is_wanted=is_wanted,
        holder=holder,
        on_refusal=lambda refusal: found.refused.put_nowait(refusal),
    )
    found = End(me, host)
    try:
        found.port = found.host.open("tcp://127.0.0.1:*")
        yield found
    finally:
        await found.host.close()


async def refuses_connections(port: int) -> None:
    """Wait until ZeroMQ's own thread has closed a port."""

    def is_refused() -> bool:
        with socket.socket() as late:
            return late.connect_ex(("127.0.0.1", port)) == errno.ECONNREFUSED

    await until_async(f"port {port} is closed", is_refused)


async def compared(rover: End, base: End) -> tuple[Comparing, Comparing]:
    rover.asks(base)
    return await rover.sees(Comparing), await base.sees(Comparing)


class Stranger:
    """Sends anything to a host that waits for pairing, with a new key."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], to: End) -> None:
        self.keys = HostKeys.generate()
        self.socket = dialling(context, self.keys, to.key)
        self.socket.connect(to.address)

    def says(self, *parts: bytes | Said) -> None:
        self.socket.send_multipart([p if isinstance(p, bytes) else encode(p) for p in parts])

    async def hears(self) -> Said:
        """The next message that is not there for the connection's sake only."""
        said: Said = Beat()
        while isinstance(said, Beat):
            is_there = await asyncio.to_thread(self.socket.poll, int(PATIENCE_S) * 1000)
            assert is_there, "nothing was said"
            said = decode(self.socket.recv())
        return said

    async def compares(self) -> None:
        """Come as far as the code."""
        self.says(Ask(self.keys.public, "stranger"))
        assert isinstance(await self.hears(), Commit)
        self.says(Nonce(b"n" * 16))
        assert isinstance(await self.hears(), Nonce)


@pytest.fixture
def stranger_to() -> Iterator[Callable[[End], Stranger]]:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    strangers: list[Stranger] = []

    def stranger_to(there: End) -> Stranger:
        strangers.append(Stranger(context, there))
        return strangers[-1]

    yield stranger_to
    for stranger in strangers:
        stranger.socket.close(0)
    context.term()


async def test_hosts_that_show_the_same_code_agree() -> None:
    async with end("rover") as rover, end("base") as base:
        here, there = await compared(rover, base)
        assert here.code == there.code
        assert (here.name, here.key, there.name, there.key) == (
            "base",
            base.key,
            "rover",
            rover.key,
        )
        rover.says_yes()
        assert (await rover.sees(Comparing, lambda state: state.is_confirmed)).code == here.code
        assert not isinstance(base.host.state, Agreed)
        base.says_yes()
        assert await base.sees(Agreed) == Agreed(rover.key, "rover")
        assert await rover.sees(Agreed) == Agreed(base.key, "base")


async def test_host_that_was_asked_may_be_confirmed_first() -> None:
    async with end("rover") as rover, end("base") as base:
        await compared(rover, base)
        base.says_yes()
        await base.sees(Comparing, lambda state: state.is_confirmed)
        rover.says_yes()
        assert await rover.sees(Agreed) == Agreed(base.key, "base")
        assert await base.sees(Agreed) == Agreed(rover.key, "rover")


@pytest.mark.parametrize("who", ["asking", "answering"])
async def test_no_of_either_person_ends_it_for_both(who: str) -> None:
    async with end("rover") as rover, end("base") as base:
        await compared(rover, base)
        refusing, other = (rover, base) if who == "asking" else (base, rover)
        other.says_yes()
        refusing.host.refuse()
        assert await refusing.fails() == await other.fails() == "PAIRING_REFUSED"
        with pytest.raises(PeerRefused, match="PAIRING_ORDER"):
            other.host.confirm("000 000")


async def test_no_counts_that_waits_to_be_read_when_its_connection_is_found_gone(
    clock: VirtualClock,
) -> None:
    async with end("rover") as rover, end("base") as base:
        await compared(rover, base)
        connections = Accepted(base.port)

        def refuse_while_nothing_is_read() -> None:
            rover.host.refuse()
            connections.until_closed()

        clock.call_later(channel.BEAT_S / 100, refuse_while_nothing_is_read)
        clock.skip(channel.BEAT_S)  # so that base's sign of life comes next, before it reads
        await until_async("base has noticed", lambda: not isinstance(base.host.state, Comparing))
        assert isinstance(base.host.state, Failed)
        assert base.host.state.problem.code == "PAIRING_REFUSED"


async def test_another_code_than_the_one_shown_is_not_confirmed() -> None:
    async with end("rover") as rover, end("base") as base:
        here, _ = await compared(rover, base)
        wrong = f"{(int(here.code.replace(' ', '')) + 1) % 10**6:06d}"
        with pytest.raises(PeerRefused, match="PAIRING_CODE"):
            rover.host.confirm(wrong)
        rover.host.confirm(here.code.replace(" ", ""))
        base.says_yes()
        assert await rover.sees(Agreed) == Agreed(base.key, "base")


async def test_nothing_is_confirmed_before_there_is_a_code() -> None:
    async with end("rover") as rover:
        with pytest.raises(PeerRefused, match="PAIRING_ORDER"):
            rover.host.confirm("123 456")


async def test_attacker_between_the_hosts_is_seen_by_the_codes() -> None:
    """Mallory answers the rover as the base, and asks the base as the rover."""
    mallory = HostKeys.generate()
    as_base, as_rover = Identity("base", mallory), Identity("rover", mallory)
    async with (
        end("rover") as rover,
        end(as_base) as to_rover,
        end(as_rover) as to_base,
        end("base") as base,
    ):
        (here, _), (_, there) = await compared(rover, to_rover), await compared(to_base, base)
        assert here.code != there.code
        assert (here.name, there.name) == ("base", "rover")
        assert here.fingerprint == there.fingerprint == fingerprint(mallory.public)
        to_rover.says_yes()
        to_base.says_yes()
        rover.host.refuse()
        base.host.refuse()
        assert await rover.fails() == await base.fails() == "PAIRING_REFUSED"


async def test_fourth_try_is_refused_and_closes_the_window(
    stranger_to: Callable[[End], Stranger],
) -> None:
    async with end("base") as base:
        for number in range(TRIES):
            told = len(base.states)
            guessing = stranger_to(base)
            await guessing.compares()
            await base.sees(Comparing, since=told)
            guessing.says(Ended(Ending.OVER))
            left = await base.sees(Waiting, since=told + 1)
            assert left.tries_left == TRIES - 1 - number
        fourth = stranger_to(base)
        fourth.says(Ask(fourth.keys.public, "stranger"))
        assert await fourth.hears() == Ended(Ending.TRIES)
        assert await base.fails() == "PAIRING_TRIES"


async def test_try_that_learned_nothing_does_not_count(
    stranger_to: Callable[[End], Stranger],
) -> None:
    async with end("base") as base, end("rover") as rover:
        for _ in range(TRIES + 1):
            told = len(base.states)
            asking = stranger_to(base)
            asking.says(Ask(asking.keys.public, "stranger"))
            assert isinstance(await asking.hears(), Commit)
            asking.says(Ended(Ending.OVER))
            assert (await base.sees(Waiting, since=told)).tries_left == TRIES
        here, there = await compared(rover, base)
        assert here.code == there.code


async def test_window_closes_by_itself(
    monkeypatch: pytest.MonkeyPatch, clock: VirtualClock
) -> None:
    monkeypatch.setattr(pairing, "WINDOW_S", 0.5)  # before either gives a sign of life
    async with end("rover") as rover, end("base") as base:
        await compared(rover, base)
        rover.says_yes()
        await clock.advance(0.5)
        assert await rover.fails() == await base.fails() == "PAIRING_OVER"
        await refuses_connections(base.port)


@pytest.mark.parametrize(
    ("who_says_yes", "here", "there"),
    [
        ("no_one", "here or at base", "here or at rover"),
        ("here", "no one at base", "and no one at this host"),
    ],
)
async def test_end_of_the_window_tells_who_did_not_answer(
    who_says_yes: str, here: str, there: str, clock: VirtualClock
) -> None:
    async with end("rover") as rover, end("base") as base:
        await compared(rover, base)
        if who_says_yes == "here":
            rover.says_yes()
            await clock.advance(channel.BEAT_S)
        await clock.advance(pairing.WINDOW_S)
        for one, told in ((rover, here), (base, there)):
            problem = (await one.sees(Failed)).problem
            assert problem.code == "PAIRING_OVER" and told in problem.message


async def test_yes_holds_until_the_end_of_the_window(clock: VirtualClock) -> None:
    """People take their time: what both hosts send meanwhile to learn of each other is no flood."""
    async with end("rover") as rover, end("base") as base:
        await compared(rover, base)
        rover.says_yes()
        await clock.advance(pairing.WINDOW_S - 1)
        base.says_yes()
        assert await rover.sees(Agreed) == Agreed(base.key, "base")
        assert await base.sees(Agreed) == Agreed(rover.key, "rover")
        assert not [s for s in (*rover.states, *base.states) if getattr(s, "problem", None)]


async def test_yes_holds_for_a_later_try_with_the_same_host() -> None:
    keys = HostKeys.generate()
    async with end("rover") as rover:
        async with end(Identity("base", keys)) as base:
            first, _ = await compared(rover, base)
            rover.says_yes()
            port = base.port
        gone = await rover.gives_up("PAIRING_OVER")
        assert gone.problem is not None and "no one at base has said yes" in gone.problem.message
        async with end(Identity("base", keys)) as base:
            rover.host.ask(keys.public, [f"tcp://127.0.0.1:{port}", base.address])
            shown = await base.sees(Comparing)
            assert shown.code != first.code
            again = await rover.sees(Comparing, lambda state: state.code == shown.code)
            assert again.is_confirmed
            assert not isinstance(base.host.state, Agreed)
            base.says_yes()
            assert await rover.sees(Agreed) == Agreed(keys.public, "base")
            await base.sees(Agreed)


async def test_window_that_the_other_host_closed_first_is_what_the_end_tells(
    clock: VirtualClock,
) -> None:
    """A host that dials another one after its window closed gets no answer: that is no news."""
    async with end("rover") as rover:
        async with end("base") as base:
            rover.asks(base)
            await clock.advance_until(rover.sees(Comparing))
            rover.says_yes()
            await clock.advance(channel.BEAT_S)
        await clock.advance_until(rover.gives_up("PAIRING_OVER"))
        for _ in range(40):
            await clock.advance_until(asyncio.sleep(0.5))
        await clock.advance(pairing.WINDOW_S)
        problem = (await rover.sees(Failed)).problem
        assert (problem.code, problem.where) == ("PAIRING_OVER", "base")
        waiting = (state for state in rover.states if isinstance(state, Waiting) and state.problem)
        told = {state.problem.code for state in waiting if state.problem}
        assert told == {"PAIRING_OVER"}


async def test_yes_to_one_host_is_none_to_another() -> None:
    async with end("rover") as rover:
        async with end("base") as base:
            await compared(rover, base)
            rover.says_yes()
        await rover.gives_up("PAIRING_OVER")
        async with end("base") as other:
            rover.asks(other)
            met = await rover.sees(Comparing, lambda state: state.key == other.key)
            assert not met.is_confirmed


async def test_hosts_of_one_name_are_refused_and_both_told() -> None:
    async with end("rover") as asking, end("rover") as asked:
        asking.asks(asked)
        for one in (asking, asked):
            problem = (await one.sees(Failed)).problem
            assert (problem.code, problem.where) == ("PAIRING_NAME", "rover")
            assert "name" in problem.fix
        assert not any(isinstance(state, Comparing) for state in (*asking.states, *asked.states))


@pytest.mark.parametrize("who", ["asking", "answering"])
async def test_host_of_a_name_that_is_known_already_is_refused_and_both_told(who: str) -> None:
    known = HostKeys.generate().public
    async with end("rover", holder={"base": known}.get) as rover, end("base") as base:
        rover.asks(base) if who == "asking" else base.asks(rover)
        problem = (await rover.sees(Failed)).problem
        assert (problem.code, problem.have) == ("PAIRING_NAME", fingerprint(base.key))
        assert fingerprint(known) in problem.fix
        assert (await base.sees(Failed)).problem.code == "PAIRING_NAME"


async def test_host_that_is_known_may_be_paired_again() -> None:
    me = identity("base")
    async with end("rover", holder=lambda name: me.key) as rover, end(me) as base:
        here, there = await compared(rover, base)
        assert here.code == there.code


async def test_end_of_the_window_tells_why_no_host_was_reached(clock: VirtualClock) -> None:
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        async with end("rover") as rover:
            rover.host.ask(
                HostKeys.generate().public, [f"tcp://127.0.0.1:{closed.getsockname()[1]}"]
            )
            await rover.gives_up("PEER_SILENT")
            await clock.advance(pairing.WINDOW_S)
            assert "PEER_SILENT" in (await rover.sees(Failed)).problem.message


async def test_host_with_another_key_than_hinted_is_not_asked() -> None:
    async with end("rover") as rover, end("base") as base:
        rover.host.ask(HostKeys.generate().public, [base.address])
        await rover.gives_up("PEER_MISMATCH")
        assert not any(isinstance(state, Comparing) for state in base.states)


async def test_address_that_leads_nowhere_is_no_matter_beside_one_that_works() -> None:
    async with end("rover") as rover, end("base") as base:
        rover.host.ask(base.key, ["tcp://127.0.0.1:1", "no address", base.address])
        assert (await rover.sees(Comparing)).code == (await base.sees(Comparing)).code


async def test_asker_that_vanishes_midway_leaves_the_window_open(
    stranger_to: Callable[[End], Stranger],
) -> None:
    async with end("base") as base, end("rover") as rover:
        vanishing = stranger_to(base)
        await vanishing.compares()
        assert (await base.sees(Comparing)).name == "stranger"
        vanishing.socket.close(0)
        assert (await base.gives_up("PAIRING_VANISHED")).tries_left == TRIES - 1
        rover.asks(base)
        found = await base.sees(Comparing, lambda state: state.name == "rover")
        assert found.code == (await rover.sees(Comparing)).code


async def test_code_of_a_try_that_is_over_does_not_confirm_the_next(
    stranger_to: Callable[[End], Stranger],
) -> None:
    """The person has read one code, and says yes when there is another already."""
    async with end("base") as base, end("rover") as rover:
        rover.asks(base)
        read = await base.sees(Comparing)
        await rover.host.close()
        await base.gives_up("PAIRING_OVER")
        await stranger_to(base).compares()
        await base.sees(Comparing, lambda state: state.name == "stranger")
        with pytest.raises(PeerRefused, match="PAIRING_CODE"):
            base.host.confirm(read.code)


async def test_answering_host_that_vanishes_is_asked_again() -> None:
    keys = HostKeys.generate()
    async with end("rover") as rover:
        async with end(Identity("base", keys)) as base:
            first, _ = await compared(rover, base)
            port = base.port
        await rover.gives_up("PAIRING_OVER")
        async with end(Identity("base", keys)) as base:
            rover.host.ask(keys.public, [f"tcp://127.0.0.1:{port}", base.address])
            second = await rover.sees(Comparing, lambda state: state.code != first.code)
            assert (await base.sees(Comparing)).code == second.code


async def test_silent_asker_gives_way_to_the_next(
    monkeypatch: pytest.MonkeyPatch, stranger_to: Callable[[End], Stranger]
) -> None:
    monkeypatch.setattr(channel, "ANSWER_S", 0.3)
    async with end("base") as base, end("rover") as rover:
        silent = stranger_to(base)
        silent.says(Ask(silent.keys.public, "stranger"))
        assert isinstance(await silent.hears(), Commit)
        assert await silent.hears() == Ended(Ending.BROKEN)
        here, there = await compared(rover, base)
        assert here.code == there.code


async def test_second_asker_waits_until_the_first_is_done() -> None:
    async with end("base") as base, end("rover") as rover, end("other") as other:
        await compared(rover, base)
        other.asks(base)
        assert (await other.gives_up("PAIRING_BUSY")).tries_left == TRIES
        assert base.host.state == await base.sees(Comparing)
        await rover.host.close()
        assert (await base.sees(Comparing, lambda state: state.name == "other")).key == other.key
        base.says_yes()
        await other.sees(Comparing)
        other.says_yes()
        assert await base.sees(Agreed) == Agreed(other.key, "other")


async def test_host_that_is_not_wanted_is_told(stranger_to: Callable[[End], Stranger]) -> None:
    async with end("base", is_wanted=lambda key, name: name == "rover") as base:
        unwanted = stranger_to(base)
        unwanted.says(Ask(unwanted.keys.public, "stranger"))
        assert await unwanted.hears() == Ended(Ending.UNWANTED)
        async with end("rover") as rover:
            await compared(rover, base)


async def test_answer_of_a_host_that_is_not_wanted_is_refused() -> None:
    async with end("base") as base, end("rover", is_wanted=lambda key, name: False) as rover:
        rover.asks(base)
        await rover.gives_up("PAIRING_UNWANTED")


@pytest.mark.parametrize(
    "parts",
    [
        (b"",),
        (b"\xc1",),
        (b"x" * MAX_BYTES,),
        (b"a", b"b", b"c"),
        (Nonce(b"n" * 16),),
        (Ended(Ending.REFUSED),),
        (Beat(),),
    ],
    ids=["empty", "no msgpack", "long", "parts", "out of turn", "ended", "beat"],
)
async def test_garbage_of_strangers_is_counted_and_the_pairing_goes_on(
    parts: tuple[bytes | Said, ...], stranger_to: Callable[[End], Stranger]
) -> None:
    async with end("base") as base, end("rover") as rover:
        await compared(rover, base)
        stranger_to(base).says(*parts)
        await base.turns_away(Reason.GARBAGE)
        rover.says_yes()
        base.says_yes()
        assert await rover.sees(Agreed) == Agreed(base.key, "base")
        assert await base.sees(Agreed) == Agreed(rover.key, "rover")


@pytest.mark.parametrize(
    "said",
    [b"\xc1", Commit(PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7"), "x", bytes(32))],
    ids=["no msgpack", "out of turn"],
)
async def test_garbage_of_the_asker_ends_its_try(
    said: bytes | Said, stranger_to: Callable[[End], Stranger]
) -> None:
    async with end("base") as base:
        asking = stranger_to(base)
        await asking.compares()
        asking.says(said)
        assert await asking.hears() == Ended(Ending.BROKEN)
        await base.sees(Waiting, lambda state: state.tries_left == TRIES - 1)


async def test_key_that_was_not_proved_is_refused(
    stranger_to: Callable[[End], Stranger],
) -> None:
    async with end("base") as base, end("rover") as rover:
        lying = stranger_to(base)
        lying.says(Ask(rover.key, "rover"))
        assert await lying.hears() == Ended(Ending.BROKEN)
        await base.gives_up("PAIRING_KEY")


async def test_asker_that_talks_without_end_is_cut(
    stranger_to: Callable[[End], Stranger],
) -> None:
    async with end("base") as base:
        talking = stranger_to(base)
        await talking.compares()
        for _ in range(MOST_SENT // len(encode(Beat()))):
            talking.says(Beat())
        assert (await base.gives_up("PAIRING_BROKEN")).tries_left == TRIES - 1


async def test_asked_host_that_sends_a_message_without_end_is_cut() -> None:
    me = identity("base")
    most = 4 * MOST_SENT
    with bad_router(me) as (bad, where):
        async with end("rover") as rover, held_back(where, to_it=most, from_it=most) as address:
            rover.host.ask(me.key, [address])
            routing_id, _ = await asyncio.to_thread(bad.recv_multipart)
            bad.send_multipart([routing_id, *[bytes(MAX_BYTES // 2)] * (most // 100)])
            await rover.gives_up("PAIRING_BROKEN")


async def test_host_without_keys_cannot_ask() -> None:
    async with end("base") as base:
        context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        plain = dialling(context, None, None)
        plain.connect(base.address)  # either end may be the first to see the mismatch
        await base.turns_away(Reason.MISMATCH, Reason.GARBAGE)
        plain.close(0)
        context.term()


async def test_host_without_keys_has_nothing_to_pair_with() -> None:
    with pytest.raises(PeerRefused, match="PAIRING_DEVELOPMENT"):
        PairingHost(Identity("rover", None), lambda state: None)


async def test_host_asks_again_once_there_are_descriptors() -> None:
    async with end("base") as base, end("rover") as rover:
        with descriptors_left(0):
            rover.asks(base)
        await rover.gives_up("DIAL_IMPOSSIBLE")
        await rover.sees(Comparing)


async def test_window_that_was_never_opened_closes() -> None:
    host = PairingHost(identity("rover"), lambda state: None)
    assert host.state == Idle()
    await host.close()


THINGS_SAID = st.one_of(
    st.builds(Ask, st.just(HostKeys.generate().public), st.just("stranger")),
    st.builds(Commit, st.just(HostKeys.generate().public), st.just("x"), st.just(bytes(32))),
    st.builds(Nonce, st.binary(min_size=16, max_size=16)),
    st.builds(yes, st.binary(min_size=32, max_size=32)),
    st.builds(Ended, st.sampled_from(Ending)),
    st.just(Beat()),
    st.binary(max_size=40),
)


@a_share(5)
@given(st.lists(st.lists(THINGS_SAID, max_size=6), max_size=3), st.booleans())
async def test_strangers_are_never_paired_whatever_they_send(
    talks: list[list[bytes | Said]], is_own_key: bool
) -> None:
    """And the next host is still answered, unless the tries are used up."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    async with end("base") as base, end("rover") as rover:
        strangers = [Stranger(context, base) for _ in talks]
        for stranger, talk in zip(strangers, talks, strict=True):
            for said in talk:
                own = stranger.keys.public if is_own_key else HostKeys.generate().public
                stranger.says(Ask(own, "stranger") if isinstance(said, Ask) else said)
            stranger.socket.close(1000)
        rover.asks(base)
        over = asyncio.ensure_future(base.sees(Failed))
        met = asyncio.ensure_future(base.sees(Comparing, lambda state: state.name == "rover"))
        await asyncio.wait({over, met}, return_when=asyncio.FIRST_COMPLETED)
        over.cancel()
        met.cancel()
        assert not any(isinstance(state, Agreed) for state in base.states)
    await asyncio.to_thread(context.term)


@given(st.binary(max_size=2 * MAX_BYTES))
def test_any_bytes_are_a_message_or_refused(data: bytes) -> None:
    with contextlib.suppress(NondumError):
        assert encode(decode(data)) == data


@given(st.sampled_from(Ending), st.binary(min_size=16, max_size=16))
def test_messages_survive_the_wire(why: Ending, nonce: bytes) -> None:
    for said in (Ended(why), Nonce(nonce), Beat(), Ask(HostKeys.generate().public, "rover")):
        assert decode(encode(said)) == said
