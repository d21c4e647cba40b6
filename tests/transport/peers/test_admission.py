"""Which hosts are let in or turned away, and that garbage and strangers harm no other link."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from datetime import UTC, datetime, timedelta

import pytest
import zmq
from tests.transport.peers.dealers import hello_of, raw_dealer
from tests.transport.peers.hosts import (
    PATIENCE_S,
    Host,
    Servant,
    host,
    identity,
    trusting,
    two_hosts,
    up,
)

from nondum.transport.peers import (
    DialFailed,
    HostKeys,
    Identity,
    Loss,
    PeerLost,
    PeerNode,
    PeerRefused,
    PeerUp,
    Reason,
    Security,
    Trust,
    accepted,
)
from nondum.transport.peers.certificate import issue, new_fleet
from nondum.transport.peers.listener import listening
from nondum.transport.peers.messages import MAX_MESSAGE
from nondum.transport.peers.proof import prove_enforced
from nondum.transport.peers.zap import ConnectionAttempt, Entry, ZapHandler

pytestmark = pytest.mark.anyio

NOW = datetime.now(UTC)
FLEET, FLEET_SECRET = new_fleet()
FLEET_TRUST = Trust().with_fleet(FLEET, "survey")


# RFC 23/ZMTP 3.0: what every connection begins with, here without security.
ZMTP_GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)
ZMTP_READY = b"\x04\x1c\x05READY\x0bSocket-Type\0\0\0\x06DEALER"


def certified(name: str, days: float = 30) -> Identity:
    keys = HostKeys.generate()
    ends = NOW + timedelta(days=days)
    begins = min(NOW, ends) - timedelta(days=1)
    found = issue(FLEET_SECRET, name, keys.public, not_before=begins, not_after=ends)
    return Identity(name, keys, found.to_bytes())


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_hosts_of_one_fleet_need_no_pairing() -> None:
    base, rover = certified("base"), certified("rover")
    async with host(base, FLEET_TRUST) as there, host(rover, FLEET_TRUST) as here:
        here.node.dial(there.key, [there.address])
        await up(here, there)
        assert (await there.told(PeerUp)).admitted_by == "certificate"
        assert there.node.peers[here.key].name == "rover"


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_stranger_is_turned_away_at_the_handshake() -> None:
    base = identity("base")
    async with host(base) as there, host(identity("rover"), trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        failure = await here.told(DialFailed)
        assert failure.problem.code == "PEER_TURNED_AWAY"
        assert there.node.refusals.counts == {Reason.UNKNOWN_KEY: 1}
        assert there.node.refusals.latest[0].key == here.key


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_turned_away_host_is_let_in_once_it_is_paired() -> None:
    """libzmq itself would never try again."""
    base, rover = identity("base"), identity("rover")
    async with host(base) as there, host(rover, trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        await here.told(DialFailed)
        there.node.set_trust(trusting(rover))
        await here.told(PeerUp)


async def test_host_of_a_fleet_without_certificate_is_told_why() -> None:
    base = certified("base")
    async with host(base, FLEET_TRUST) as there, host(identity("rover"), trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        assert (await here.told(DialFailed)).problem.code == "KEY_UNKNOWN"
        assert Reason.UNKNOWN_KEY in there.node.refusals.counts


@pytest.mark.parametrize(
    ("who", "code"),
    [
        (lambda: certified("rover", days=-2), "CERTIFICATE_TIME"),
        (lambda: identity("rover", None, certified("rover").certificate), "CERTIFICATE_KEY"),
        (lambda: identity("rover", None, b"nonsense"), "CERTIFICATE_MALFORMED"),
    ],
    ids=["ended", "another host's", "malformed"],
)
async def test_certificate_that_does_not_hold_is_refused(who: object, code: str) -> None:
    base = certified("base")
    async with host(base, FLEET_TRUST) as there, host(who(), trusting(base)) as here:  # type: ignore[operator]  # one of the above
        here.node.dial(there.key, [there.address])
        assert (await here.told(DialFailed)).problem.code == code
        assert there.node.refusals.counts[Reason.CERTIFICATE] >= 1
        assert here.key not in there.node.peers


async def test_certificate_that_ends_ends_the_link() -> None:
    now = [NOW]
    base, rover = certified("base"), certified("rover", days=1)
    events: asyncio.Queue[object] = asyncio.Queue()
    node = PeerNode(base, FLEET_TRUST, Servant(), on_event=events.put_nowait, clock=lambda: now[0])
    (address,) = await node.start(["tcp://127.0.0.1:0"])
    async with host(rover, FLEET_TRUST) as here:
        here.node.dial(base.key, [address])
        await here.told(PeerUp)
        now[0] += timedelta(days=2)
        assert (await here.told(PeerLost)).reason in (Loss.TURNED_AWAY, Loss.DISCONNECTED)
    await node.close()


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_revoked_peer_is_cut_while_it_talks() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "wait", {}, deadline_s=60)
        await base.servant.running.get()
        base.node.set_trust(trusting(rover.node.identity).with_revoked(rover.key, "stolen"))
        assert (await base.told(PeerLost)).reason is Loss.REVOKED
        assert (await rover.told(PeerLost)).reason is Loss.TURNED_AWAY
        assert await asyncio.wait_for(base.servant.ended.get(), 30) == "cancelled"
        with pytest.raises(Exception, match="PEER_LOST"):
            await call
        await base.counted(Reason.REVOKED)
        assert rover.key not in base.node.peers


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_revoked_connection_is_shut_even_if_its_host_does_not_listen() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there:
        with raw_dealer(there, rover) as stubborn:
            ended = stubborn.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            stubborn.send(hello_of(rover))
            await there.told(PeerUp)
            there.node.set_trust(Trust().with_revoked(rover.key, "stolen"))
            assert await asyncio.to_thread(ended.poll, 1000)
            stubborn.disable_monitor()
            ended.close(0)


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_wrong_server_key_is_counted_at_both_ends() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        here.node.dial(HostKeys.generate().public, [there.address])
        assert (await here.told(DialFailed)).problem.code == "PEER_MISMATCH"
        await there.counted(Reason.MISMATCH)


async def test_host_without_keys_is_turned_away() -> None:
    async with host(identity("base"), trusting(identity("rover"))) as there:
        context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        with context.socket(zmq.DEALER) as plain:
            plain.linger = 0
            plain.connect(there.address)
            await asyncio.wait_for(there.refused.wait(), PATIENCE_S)
        context.destroy(linger=0)
        # When the other end is the first to see that they do not match, it just goes.
        assert there.node.refusals.counts.keys() <= {Reason.MISMATCH, Reason.GARBAGE}


@pytest.mark.usefixtures("each_kind_of_sockets")
@pytest.mark.parametrize(
    "noise",
    [b"GET / HTTP/1.1\r\n\r\n" * 20, b"\xff" * 400, b"\0" * 400, os.urandom(4096)],
    ids=["HTTP", "ones", "noughts", "random"],
)
async def test_sender_of_garbage_is_dropped_and_other_links_work(noise: bytes) -> None:
    async with two_hosts() as (rover, base):
        with tcp(base) as speaker:
            speaker.sendall(noise)
            assert await rover.node.call(base.key, "echo", {"a": 1}, deadline_s=5) == {"a": 1}
            await asyncio.wait_for(base.refused.wait(), PATIENCE_S)


async def test_slow_strangers_are_cut_and_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(accepted, "AWAITED_S", 0.5)
    monkeypatch.setattr(accepted, "MAX_STRANGERS", 20)
    async with two_hosts() as (rover, base):
        idle = [tcp(base) for _ in range(50)]
        for stranger in idle:
            stranger.send(b"\xff\0\0")  # the beginning of a greeting, and nothing more
        assert await rover.node.call(base.key, "echo", {}, deadline_s=5) == {}
        await base.counted(Reason.CROWDED, 30)
        await base.counted(Reason.SILENT, 20)
        assert base.node.strangers == 0
        for stranger in idle:
            stranger.close()
        assert await rover.node.call(base.key, "echo", {}, deadline_s=5) == {}


async def test_message_without_end_is_cut_before_it_fills_the_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """ZeroMQ bounds the parts of a message, but not how many there are."""
    monkeypatch.setattr(accepted, "AWAITED_S", 1e6)  # only what it sends can end it
    async with host(Identity("base", None)) as there:
        with tcp(there) as endless:
            endless.sendall(ZMTP_GREETING + ZMTP_READY)
            heard = b""
            while b"READY" not in heard:
                heard += await asyncio.to_thread(endless.recv, 1000)
            part = b"\x03" + (10_000).to_bytes(8, "big") + b"x" * 10_000  # 3: long, more to come
            counting = asyncio.ensure_future(there.counted(Reason.SILENT))
            while not counting.done():
                with contextlib.suppress(OSError):  # it is cut in the middle
                    endless.sendall(part)
                await asyncio.sleep(0.001)  # a pace: some 10 MB/s
            await counting


@pytest.mark.parametrize(
    "data", [b"", b"\xc1", b"\x91\x09", os.urandom(300)], ids=["empty", "never", "short", "random"]
)
async def test_malformed_message_of_a_peer_ends_its_session_alone(data: bytes) -> None:
    base, rover, other = identity("base"), identity("rover"), identity("other")
    async with host(base, trusting(rover, other)) as there, host(other, trusting(base)) as good:
        good.node.dial(there.key, [there.address])
        await up(good, there)
        with raw_dealer(there, rover) as bad:
            bad.send(hello_of(rover))
            await there.told(PeerUp, rover.key)
            bad.send(data)
            assert (await there.told(PeerLost)).reason is Loss.VIOLATED
        assert there.node.refusals.counts[Reason.GARBAGE] == 1
        assert await good.node.call(there.key, "echo", {}, deadline_s=5) == {}


async def test_message_before_the_greeting_is_garbage() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there, asyncio.timeout(PATIENCE_S):
        with raw_dealer(there, rover) as rude:
            rude.send(b"\x92\x09\x01")
            await there.counted(Reason.GARBAGE)
        assert not there.node.peers


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_name_of_another_in_the_greeting_is_no_proof() -> None:
    base, rover, victim = identity("base"), identity("rover"), identity("victim")
    async with host(base, trusting(rover, victim)) as there:
        with raw_dealer(there, rover) as liar:
            liar.send(hello_of(victim))
            await there.counted(Reason.NOT_PROVED)
        assert not there.node.peers


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_longer_message_than_allowed_cuts_the_sender_alone() -> None:
    base, rover, other = identity("base"), identity("rover"), identity("other")
    async with host(base, trusting(rover, other)) as there, host(other, trusting(base)) as good:
        good.node.dial(there.key, [there.address])
        await up(good, there)
        with raw_dealer(there, rover) as big:
            big.send(hello_of(rover))
            await there.told(PeerUp, rover.key)
            big.send(b"x" * (MAX_MESSAGE + 1))
            assert (await there.told(PeerLost)).key == rover.key
        assert await good.node.call(there.key, "echo", {}, deadline_s=5) == {}


async def test_unsupported_version_is_reported() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there:
        with raw_dealer(there, rover) as future:
            future.send(hello_of(rover, versions=(99,)))
            await there.counted(Reason.VERSION)


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_development_mode_is_explicit_and_stays_on_this_machine() -> None:
    rover, base = Identity("rover", None), Identity("base", None)
    async with host(base) as there, host(rover) as here:
        assert there.node.security is Security.DEVELOPMENT
        here.node.dial(there.key, [there.address])
        await up(here, there)
        assert await here.node.call(there.key, "echo", {}, deadline_s=5) == {}
        with pytest.raises(PeerRefused, match="DEVELOPMENT_LOOPBACK"):
            here.node.dial(there.key, ["tcp://192.0.2.1:7000"])
    with pytest.raises(PeerRefused, match="DEVELOPMENT_LOOPBACK"):
        async with host(base, address="tcp://*:0"):
            pass


async def test_host_with_keys_and_host_without_do_not_meet() -> None:
    rover = identity("rover")
    async with host(Identity("base", None)) as there, host(rover, trusting(rover)) as here:
        here.node.dial(HostKeys.generate().public, [there.address])
        assert (await here.told(DialFailed)).problem.code == "PEER_MISMATCH"


async def test_second_authenticator_of_a_context_is_refused() -> None:
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    first = ZapHandler(context, lambda _: Entry.TURNED_AWAY)
    with pytest.raises(PeerRefused, match="ZAP_TAKEN"):
        ZapHandler(context, lambda _: Entry.LET_IN)
    first.close()
    context.term()


async def test_judge_that_fails_turns_away_and_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    """An exception must not leave later handshakes hanging."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    asked: list[ConnectionAttempt] = []

    def judge(attempt: ConnectionAttempt) -> Entry:
        asked.append(attempt)
        raise RuntimeError("no judge today")

    handler = ZapHandler(context, judge)
    keys = HostKeys.generate()
    sock = listening(context, keys)
    for _ in range(2):
        await prove_enforced(sock, keys, lambda _: None)
    assert len(asked) == 2
    assert "no judge today" in caplog.text
    sock.close()
    handler.close()
    context.term()


@pytest.mark.usefixtures("each_kind_of_sockets")
async def test_self_test_leaves_no_trace() -> None:
    async with host(identity("base")) as there:
        assert there.node.refusals.counts == {}


def tcp(there: Host) -> socket.socket:
    where, _, port = there.address.removeprefix("tcp://").rpartition(":")
    return socket.create_connection((where, int(port)), timeout=5)
