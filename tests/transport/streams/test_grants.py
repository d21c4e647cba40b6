"""A stream goes to the key that it was granted to, once, and to no other key."""

from __future__ import annotations

import asyncio
import contextlib

import pytest
import zmq
from tests.transport.streams.ends import PATIENCE_S, Granted, Owner, Raw, owner, stalling, within

from nondum.sdk.errors import Problem
from nondum.sdk.wire import pack
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import HostKeys
from nondum.transport.peers.refusals import Reason
from nondum.transport.streams import Exporter, outgoing, packets
from nondum.transport.streams.packets import VERSION, Claim, Handled, Opened, Over, Pong

pytestmark = pytest.mark.anyio

READER, OTHER = HostKeys.generate(), HostKeys.generate()


async def works(host: Owner) -> None:
    """A newly granted stream arrives."""
    granted = host.grant(READER)
    reading = host.read(READER, granted)
    await within(granted.claimed)
    granted.send()
    assert b"".join((await reading.until(1)).pieces) == b"pixels"
    granted.outgoing.end(Problem("STREAM_ENDED", "enough"))
    assert (await within(reading.over)).message == "enough"


async def test_granted_stream_arrives_with_its_type() -> None:
    async with owner() as host:
        granted = host.grant(READER, "depth")
        reading = host.read(READER, granted)
        assert await within(reading.opened) == "depth"
        await works(host)


async def test_longest_frame_arrives() -> None:
    async with owner() as host:
        granted = host.grant(READER)
        reading = host.read(READER, granted)
        await within(granted.claimed)
        granted.send(bytes(packets.MAX_BULK))
        assert sum(map(len, (await reading.until(1)).pieces)) == packets.MAX_BULK


async def test_longest_message_of_a_reader_arrives() -> None:
    longest = pack([1, packets.VERSION, "x" * (packets.MAX_ASKED - 6)])
    assert len(longest) == packets.MAX_ASKED
    async with owner() as host:
        raw = host.raw(READER, host.grant(READER))
        raw.say(longest)
        assert isinstance(await raw.hears(), Over)


async def test_key_without_a_grant_is_not_let_in() -> None:
    async with owner() as host:
        granted = host.grant(READER)
        stranger = host.read(OTHER, granted)
        assert (await within(stranger.over)).code == "STREAM_NOT_GRANTED"
        assert not granted.claimed.done()
        await within(host.read(READER, granted).opened)


async def test_grant_of_another_key_cannot_be_claimed() -> None:
    async with owner() as host:
        theirs, own = host.grant(READER), host.grant(OTHER)
        thief = host.read(OTHER, theirs)
        assert (await within(thief.over)).code == "STREAM_NOT_GRANTED"
        assert not theirs.claimed.done()
        await within(host.read(OTHER, own).opened)
        await within(host.read(READER, theirs).opened)


async def test_grant_holds_for_one_connection() -> None:
    async with owner() as host:
        granted, spare = host.grant(READER), host.grant(READER)
        first = host.read(READER, granted)
        await within(first.opened)
        second = host.read(READER, granted)
        assert (await within(second.over)).code == "STREAM_NOT_GRANTED"
        granted.send()
        await first.until(1)
        await within(host.read(READER, spare).opened)


async def test_invented_token_claims_nothing() -> None:
    async with owner() as host:
        host.grant(READER)
        assert (await within(host.read(READER, "0" * 32).over)).code == "STREAM_NOT_GRANTED"


async def test_withdrawn_grant_cannot_be_claimed() -> None:
    async with owner() as host:
        granted, _other = host.grant(READER), host.grant(READER)
        granted.outgoing.end(Problem("STREAM_ENDED", "withdrawn"))
        assert (await within(host.read(READER, granted).over)).code == "STREAM_NOT_GRANTED"


def claimed(host: Owner) -> tuple[Granted, Raw]:
    """A stream that was granted to the reader, who claims it."""
    granted = host.grant(READER)
    raw = host.raw(READER, granted)
    raw.say(packets.asked(Claim(VERSION, granted.outgoing.token)))
    return granted, raw


async def opened(host: Owner) -> tuple[Granted, Raw]:
    """The same, and it is open."""
    granted, raw = claimed(host)
    assert await raw.hears() == Opened("image")
    return granted, raw


async def test_ended_stream_is_cut() -> None:
    """Not merely told: a reader that does not listen gets no more, either."""
    async with owner() as host:
        granted, raw = await opened(host)
        granted.outgoing.end(Problem("STREAM_ENDED", "withdrawn"))
        assert isinstance(await raw.hears(), Over)
        assert not granted.outgoing.can_send
        await works(host)


async def test_unclaimed_grant_lapses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outgoing, "CLAIM_S", 0.2)
    async with owner() as host:
        granted = host.grant(READER)
        assert (await within(granted.over)).code == "STREAM_UNCLAIMED"
        assert (await within(host.read(READER, granted).over)).code == "STREAM_NOT_GRANTED"


async def test_silent_reader_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outgoing, "SILENT_S", 0.5)
    async with owner() as host:
        granted = host.grant(READER)
        host.raw(READER, granted).say(packets.asked(Claim(VERSION, granted.outgoing.token)))
        assert (await within(granted.over)).code == "STREAM_SILENT"


async def test_reader_that_closes_is_noticed_at_once() -> None:
    async with owner() as host:
        granted = host.grant(READER)
        reading = host.read(READER, granted)
        await within(reading.opened)
        reading.incoming.close()
        assert (await within(granted.over)).code == "STREAM_LOST"


@pytest.mark.parametrize(
    "parts",
    [
        (b"garbage",),
        (b"",),
        (packets.asked(Handled(7)),),
        (packets.asked(Handled(1)), b"more"),
        (b"more", packets.asked(packets.Ping(1.0))),
        (packets.asked(Claim(VERSION, "again")),),
    ],
    ids=["garbage", "empty", "never-sent", "two-parts", "two-parts-the-last-sound", "claim"],
)
async def test_reader_that_breaks_the_rules_loses_its_stream(parts: tuple[bytes, ...]) -> None:
    async with owner() as host:
        granted, raw = await opened(host)
        raw.say(*parts)
        told = await raw.hears()
        assert isinstance(told, Over)
        assert told.problem.code in {"BRIDGE_PACKET", "PACKET_MALFORMED"}
        assert (await within(granted.over)) == told.problem
        await works(host)


async def test_flood_of_signs_of_life_is_cut() -> None:
    async with owner() as host:
        granted, raw = claimed(host)
        for _ in range(100):
            raw.say(packets.asked(packets.Ping(1.0)))
        assert (await within(granted.over)).code == "BRIDGE_PACKET"
        await works(host)


@pytest.mark.parametrize(
    "parts",
    [
        (b"garbage",),
        (packets.asked(Handled(1)),),
        (packets.asked(Claim(VERSION + 1, "x")),),
        (b"a", b"b"),
    ],
    ids=["garbage", "no-claim", "version", "two-parts"],
)
async def test_first_message_must_be_the_claim(parts: tuple[bytes, ...]) -> None:
    async with owner() as host:
        granted = host.grant(READER)
        raw = host.raw(READER, granted)
        raw.say(*parts)
        assert isinstance(await raw.hears(), Over)
        assert not granted.claimed.done()
        await within(host.read(READER, granted).opened)


@pytest.mark.parametrize("version", [VERSION - 1, VERSION + 1], ids=["before", "next"])
async def test_claim_in_another_version_is_told_so(version: int) -> None:
    async with owner() as host:
        granted = host.grant(READER)
        raw = host.raw(READER, granted)
        raw.say(packets.asked(Claim(version, granted.outgoing.token)))
        told = await raw.hears()
        assert isinstance(told, Over)
        assert told.problem.code == "BRIDGE_VERSION"
        assert not granted.claimed.done()


async def test_readers_are_told_that_the_bridge_ends() -> None:
    async with owner() as host:
        _, raw = await opened(host)
        host.exporter.close()
        told = await raw.hears()
        assert isinstance(told, Over)
        assert told.problem.code == "STREAM_ENDED"


async def test_oversized_message_cuts_its_sender_only() -> None:
    async with owner() as host:
        granted, raw = await opened(host)
        raw.say(b"x" * 100_000)
        assert (await within(granted.over)).code == "STREAM_LOST"
        await works(host)


async def test_message_without_an_end_is_cut() -> None:
    """ZeroMQ bounds messages, but not how many parts they have."""
    async with owner() as host:
        granted, raw = await opened(host)
        raw.say(*([b"x" * 1000] * 1000), b"the end that comes too late")
        assert (await within(granted.over)).code in {"BRIDGE_PACKET", "STREAM_LOST"}
        await works(host)


async def test_sender_of_a_message_without_its_last_part_is_cut() -> None:
    """It is never handed over by ZeroMQ, and so is known only by what the kernel has received."""
    async with owner() as host, stalling(host.port, to_port=600_000, to_client=10_000_000) as port:
        granted = host.grant(READER)
        raw = host.raw(READER, granted, port=port)
        raw.say(packets.asked(Claim(VERSION, granted.outgoing.token)))
        assert await raw.hears() == Opened("image")
        raw.say(*([b"x" * 10] * 30_000))
        assert (await within(granted.over)).code == "BRIDGE_PACKET"
        await works(host)


async def test_stranger_without_keys_gets_nothing() -> None:
    async with owner() as host:
        granted = host.grant(READER)
        reader, writer = await asyncio.open_connection("127.0.0.1", host.port)
        writer.write(b"GET / HTTP/1.0\r\n\r\n" + b"\xff" * 4096)
        async with asyncio.timeout(PATIENCE_S):
            with contextlib.suppress(ConnectionResetError):
                assert len(await reader.read()) <= 64  # ZeroMQ's greeting
        writer.close()
        await within(host.read(READER, granted).opened)
        assert host.exporter.refusals.counts[Reason.GARBAGE] == 1


async def test_bridge_listens_at_addresses_of_this_machine_only() -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    exporter = Exporter(context, READER)
    with pytest.raises(PeerRefused, match="ADDRESS_UNUSABLE"):
        await exporter.start(("203.0.113.9",))
    exporter.close()
    context.term()


async def test_signs_of_life_tell_the_owners_clock() -> None:
    async with owner() as host:
        _, raw = claimed(host)
        raw.say(packets.asked(packets.Ping(42.0)))
        assert await raw.hears() == Opened("image")
        answer = await raw.hears()
        assert isinstance(answer, Pong)
        assert answer.at_s == 42.0
        assert answer.clock_s <= asyncio.get_running_loop().time()


async def test_frames_wait_until_the_owners_clock_is_known() -> None:
    async with owner() as host:
        granted = host.grant(READER)
        granted.sends_at_once = 2
        reading = host.read(READER, granted)
        await reading.until(2)
        granted.send()
        await reading.until(3)
        assert [frame.seq for frame in reading.frames] == [1, 2, 3]
        assert reading.untimed == []
