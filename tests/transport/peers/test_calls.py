"""Calls between two hosts that know each other."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.clock import VirtualClock
from tests.transport.peers.hosts import (
    PATIENCE_S,
    Host,
    host,
    identity,
    raises,
    trusting,
    two_hosts,
    up,
)

from nondum.sdk.errors import ProtocolViolation
from nondum.transport.peers import DialFailed, PeerUnreachable, PeerUp, Security
from nondum.transport.peers.calls import CREDIT
from nondum.transport.peers.messages import MAX_MESSAGE, Notice, encode

pytestmark = pytest.mark.anyio


async def test_call_is_answered() -> None:
    async with two_hosts() as (rover, base):
        answer = await rover.node.call(base.key, "echo", {"n": [1, "é", b"\0"]}, deadline_s=5)
        assert answer == {"n": [1, "é", b"\0"]}


async def test_both_ends_may_call() -> None:
    async with two_hosts() as (rover, base):
        assert await base.node.call(rover.key, "echo", {"a": 1}, deadline_s=5) == {"a": 1}


async def test_peers_are_told_by_the_names_that_they_were_paired_under() -> None:
    async with two_hosts() as (rover, base):
        event = await rover.told(PeerUp)
        assert (event.key, event.name, event.admitted_by) == (base.key, "base", "pairing")
        assert event.epoch == base.node.epoch
        assert base.node.peers[rover.key].name == "rover"


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_a_thousand_calls_at_once_come_back_to_their_callers() -> None:
    async with two_hosts() as (rover, base):

        async def ask(first: int) -> None:
            for n in range(first, first + 50):
                assert await rover.node.call(base.key, "echo", {"n": n}, deadline_s=20) == {"n": n}

        await asyncio.gather(*(ask(first) for first in range(0, 1000, 50)))
        assert len(base.servant.served) == 1000


async def test_problems_of_the_other_end_are_raised() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "unknown", {}, deadline_s=5)
        assert await raises(lambda: call) == ["NO_METHOD"]


async def test_a_broken_handler_is_told_and_harms_nothing(caplog: pytest.LogCaptureFixture) -> None:
    async with two_hosts() as (rover, base):
        assert await raises(lambda: rover.node.call(base.key, "break", {}, deadline_s=5)) == [
            "INTERNAL"
        ]
        assert await rover.node.call(base.key, "echo", {}, deadline_s=5) == {}
    assert "broken" in caplog.text


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_progress_arrives_before_the_answer() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "count", {"to": 5}, deadline_s=5)
        assert [report["number"] async for report in call] == [0, 1, 2, 3, 4]
        assert await call == {"counted": 5}


async def test_a_slow_reader_of_progress_gets_the_newest() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "count", {"to": 500}, deadline_s=5)
        await call
        heard = [report["number"] async for report in call]
        assert len(heard) <= 64
        assert heard == sorted(heard)


async def test_notice_arrives_unanswered() -> None:
    async with two_hosts() as (rover, base):
        rover.node.notify(base.key, "moved", {"to": 3})
        heard = await asyncio.wait_for(base.servant.notices.get(), 30)
        assert heard == {"from": "rover", "method": "moved", "to": 3}


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_cancelled_caller_cancels_the_call() -> None:
    async with two_hosts() as (rover, base):
        task = asyncio.ensure_future(wait(rover, base))
        await base.servant.running.get()
        task.cancel()
        assert await asyncio.wait_for(base.servant.ended.get(), 30) == "cancelled"


async def test_halted_call_says_so() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "wait", {}, deadline_s=60)
        await base.servant.running.get()
        call.cancel()
        assert await raises(lambda: call) == ["HALTED"]


async def test_deadline_travels_and_ends_both_ends(clock: VirtualClock) -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "wait", {}, deadline_s=0.2)
        incoming = await base.servant.running.get()
        assert incoming.ends_s <= clock.time() + 0.2
        await clock.advance(0.2)
        assert await raises(lambda: call) == ["DEADLINE"]
        assert await asyncio.wait_for(base.servant.ended.get(), 30) == "cancelled"


async def test_too_long_a_request_is_refused_before_it_is_sent() -> None:
    async with two_hosts() as (rover, base):
        with pytest.raises(ProtocolViolation, match="PACKET_TOO_LONG"):
            rover.node.call(base.key, "echo", {"text": "x" * 300_000}, deadline_s=5)
        assert await rover.node.call(base.key, "echo", {}, deadline_s=5) == {}
        assert base.servant.served == ["echo"]


async def test_too_long_an_answer_is_a_problem_not_a_silence() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "long", {}, deadline_s=5)
        assert await raises(lambda: call) == ["ANSWER_UNSENDABLE"]


async def test_caller_is_told_when_the_peer_takes_no_more() -> None:
    async with two_hosts() as (rover, base):
        calls = [
            rover.node.call(base.key, "wait", {"tag": n}, deadline_s=60)
            for n in range(2)  # the loop has its turn between, or all would wait in the socket
        ]
        for _ in range(2, CREDIT):
            while True:
                try:
                    calls.append(rover.node.call(base.key, "wait", {}, deadline_s=60))
                    break
                except PeerUnreachable as busy:
                    assert busy.code == "PEER_BUSY"
                    await asyncio.sleep(0)
        with pytest.raises(PeerUnreachable, match="PEER_BUSY"):
            rover.node.call(base.key, "wait", {}, deadline_s=60)
        base.servant.gate.set()
        assert all([(await call)["waited"] for call in calls])
        assert await rover.node.call(base.key, "echo", {}, deadline_s=5) == {}


async def test_call_to_a_host_without_a_link_is_refused() -> None:
    async with two_hosts() as (rover, _):
        with pytest.raises(PeerUnreachable, match="PEER_DOWN"):
            rover.node.call(identity("other").key, "echo", {}, deadline_s=5)


async def test_both_may_dial_each_other() -> None:
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        there.node.dial(here.key, [here.address])
        await up(here, there)
        for n in range(50):
            assert await here.node.call(there.key, "echo", {"n": n}, deadline_s=5) == {"n": n}
            assert await there.node.call(here.key, "echo", {"n": n}, deadline_s=5) == {"n": n}
        assert len(there.servant.served) == len(here.servant.served) == 50


async def test_first_address_that_works_wins() -> None:
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        here.node.dial(there.key, ["tcp://192.0.2.1:9", "tcp://127.0.0.1:1", there.address])
        await up(here, there)
        assert (await here.told(PeerUp)).address == there.address


async def test_address_that_cannot_be_dialled_is_told() -> None:
    rover, base = identity("rover"), identity("base")
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        here.node.dial(there.key, ["tcp://nowhere:port", there.address])
        assert (await here.told(DialFailed)).problem.code == "ADDRESS_MALFORMED"
        await up(here, there)


async def test_round_trip_is_measured() -> None:
    async with two_hosts() as (rover, base):
        async with asyncio.timeout(60):
            while rover.node.round_trip_s(base.key) is None:
                await rover.node.call(base.key, "echo", {}, deadline_s=5)


async def test_security_can_be_shown() -> None:
    async with two_hosts() as (rover, _):
        assert rover.node.security is Security.CURVE


async def wait(rover: Host, base: Host) -> None:
    await rover.node.call(base.key, "wait", {}, deadline_s=60)


async def test_longest_message_passes_where_links_are_secured() -> None:
    async with two_hosts() as (rover, base):
        beside = len(encode(Notice("values", {"text": "x" * 100_000}))) - 100_000
        longest = {"text": "x" * (MAX_MESSAGE - beside)}
        assert len(encode(Notice("values", longest))) == MAX_MESSAGE
        rover.node.notify(base.key, "values", longest)
        async with asyncio.timeout(PATIENCE_S):
            assert (await base.servant.notices.get())["text"] == longest["text"]
        assert rover.key in base.node.peers
