"""Links in a separate process: it may end, hang, or be another program; the daemon stays."""

from __future__ import annotations

import asyncio
import functools
import os
import signal
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import zmq
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left
from tests.kit.processes import is_alive, until_gone
from tests.kit.until import arrived, until, until_async
from tests.kit.watches import watches_left
from tests.transport.peers import hosts
from tests.transport.peers.bad_ends import bad_dealer, hello_of
from tests.transport.peers.hosts import (
    PATIENCE_S,
    Host,
    Servant,
    host,
    identity,
    raises,
    trusting,
    two_hosts,
    up,
)
from tests.transport.peers.puppets import ADDRESS, Puppets, serving

from nondum.host.peers.links.process import LinksProcess
from nondum.transport.peers import (
    HostKeys,
    Identity,
    LinksFailed,
    Loss,
    PeerKey,
    PeerLost,
    PeerNode,
    PeerRefused,
    PeerUnreachable,
    PeerUp,
    Refusal,
    Trust,
)
from nondum.transport.peers.accepted import AWAITED_S
from nondum.transport.peers.heartbeat import BEAT_S
from nondum.transport.peers.listener import HIGH_WATER
from nondum.transport.peers.local_sockets import SECOND_LOOK_S
from nondum.transport.peers.messages import MAX_MESSAGE, Notice, encode
from nondum.transport.peers.socket_process import sockets
from nondum.transport.peers.socket_process.pipe import WINDOW
from nondum.transport.peers.socket_process.service import MOST_WAITING
from nondum.transport.peers.socket_process.sockets import LONGEST_WAIT_S, SocketProcess

pytestmark = pytest.mark.anyio

KEY = HostKeys.generate().public
TEXT = "x" * 100_000
LONG = encode(Notice("values", {"text": TEXT}))
CROWD = MOST_WAITING // len(LONG) + 10
"""Such messages that may wait for the other process, and some in the kernel's buffers."""
KERNELS = 160
"""Such messages that lie in the buffers of a TCP connection (tcp(7)), and a margin."""
LITTLE_BYTES = 56 * 1024**2
"""Enough to begin with, and too little for the messages that ZeroMQ lets wait."""


@pytest.fixture(autouse=True)
def _apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hosts, "SOCKETS", hosts.KINDS["apart"])


@pytest.mark.parametrize("whose", [0, 1], ids=["that dials", "that is dialled"])
async def test_links_of_a_host_come_back_after_their_process_was_killed(whose: int) -> None:
    async with two_hosts() as both:
        one, pid = both[whose], pid_of(both[whose])
        os.kill(pid, signal.SIGKILL)
        failed = (await one.told(LinksFailed)).problem
        assert failed.code == "LINKS_DIED"
        assert "SIGKILL" in failed.message
        assert not (*one.node.accepted, *one.node.dialled)
        await until_async("it has another", lambda: one.node.links_pid not in (None, pid))
        await answers(*both)


async def test_process_is_started_again_once_there_are_descriptors(clock: VirtualClock) -> None:
    async with host(identity("base")) as there:
        await asyncio.to_thread(os.getpid)  # or the clock would have to open files for its pauses
        os.kill(pid := pid_of(there), signal.SIGKILL)
        with descriptors_left(0):
            await clock.advance_until(there.told(LinksFailed))
            await clock.advance(LONGEST_WAIT_S)  # in which it is tried more than once
            assert there.node.links_pid is None
        started = until_async("it has another", lambda: there.node.links_pid not in (None, pid))
        await clock.advance_until(started)


async def test_links_that_come_back_at_once_lose_no_peer_and_no_call() -> None:
    async with two_hosts() as (rover, base):
        call = rover.node.call(base.key, "wait", {"tag": "once"}, deadline_s=PATIENCE_S)
        await base.servant.running.get()
        os.kill(pid_of(base), signal.SIGKILL)
        await base.told(LinksFailed)
        base.servant.gate.set()
        answer = await raises(lambda: call)
        assert answer == [] or answer == ["PEER_LOST"]
        assert base.servant.served.count("once") == 1
        await answers(rover, base)


async def test_process_over_its_memory_limit_ends_and_the_daemon_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The daemon stands still, so that no process takes in what comes."""
    start = functools.partial(LinksProcess, memory=LITTLE_BYTES)
    monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=start))
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there, asyncio.timeout(PATIENCE_S):
        with bad_dealer(there.address, rover, there) as bad:
            bad.send(hello_of(rover))
            await there.told(PeerUp)
            pid = pid_of(there)
            flood = functools.partial(pushed, bad)
            until("it has ended", lambda: flood() is None or not is_alive(pid))
        assert (await there.told(LinksFailed)).problem.code == "LINKS_DIED"
        monkeypatch.setattr(hosts, "SOCKETS", hosts.KINDS["apart"])
        async with host(rover, trusting(base)) as good:
            good.node.dial(there.key, [there.address])
            await up(good, there)


async def test_process_reads_no_more_than_a_daemon_that_stands_still_can_take(
    clock: VirtualClock,
) -> None:
    """The daemon's time stands still as well, so that it does not take its peer for lost."""
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there:
        with bad_dealer(there.address, rover, there) as bad:
            bad.sndhwm = 1
            bad.send(hello_of(rover))
            await there.told(PeerUp)
            most = HIGH_WATER + KERNELS + CROWD
            sent = 0
            while bad.poll(1000, zmq.POLLOUT) and sent <= 2 * most:
                bad.send(LONG)
                sent += 1
            assert sent <= most
            for _ in range(sent):  # nothing was lost
                await arrived("a notice", there.servant.notices.get())
        assert is_alive(pid_of(there))


async def test_peer_that_does_not_read_is_told_no_more_than_may_wait(clock: VirtualClock) -> None:
    """While time stands still, or it would be lost for its silence."""
    base, deaf, other = identity("base"), identity("deaf"), identity("other")
    async with host(base, trusting(deaf, other)) as there, host(other, trusting(base)) as good:
        good.node.dial(there.key, [there.address])
        await up(good, there)
        with bad_dealer(there.address, deaf, there, most_read=1) as bad:
            bad.send(hello_of(deaf))
            await there.told(PeerUp, deaf.key)
            taken = 0
            while taken <= HIGH_WATER:
                taken += notify(there, deaf.key)
                await asyncio.sleep(0)
            for _ in range(500):
                taken += notify(there, deaf.key)
                await answers(good, there)
            assert taken <= HIGH_WATER + WINDOW + KERNELS
            assert not notify(there, deaf.key)
            heard = 0
            while heard < taken:  # it reads after all
                heard += len(await asyncio.to_thread(bad.recv)) > len(TEXT)


async def test_daemon_keeps_little_for_a_process_that_stands_still(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sockets, "MOST_WAITING", MOST_WAITING)  # less than one peer's messages
    async with two_hosts() as (rover, base):
        os.kill(pid_of(rover), signal.SIGSTOP)
        try:
            taken = sum(notify(rover, base.key) for _ in range(WINDOW))
        finally:
            os.kill(pid_of(rover), signal.SIGCONT)
        assert taken <= 2 * CROWD
        await answers(rover, base)


async def test_connection_that_breaks_is_told_by_the_process() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there:
        pid = pid_of(there)
        with bad_dealer(there.address, rover, there) as bad:
            bad.send(hello_of(rover))
            await there.told(PeerUp)
        assert (await there.told(PeerLost)).reason is Loss.DISCONNECTED
        assert there.node.links_pid == pid


async def test_host_that_is_dialled_before_there_is_a_process_is_reached(
    clock: VirtualClock,
) -> None:
    """Without another attempt, for which time would have to pass."""
    base, rover = identity("base"), identity("rover")
    node = PeerNode(
        rover, trusting(base), Servant(), on_event=lambda _: None, sockets=hosts.SOCKETS
    )
    async with host(base, trusting(rover)) as there:
        node.dial(there.key, [there.address])
        await node.start(["tcp://127.0.0.1:0"])
        await arrived("they meet", there.linked[rover.key].wait())
        await node.close()


async def test_process_that_hangs_is_replaced(clock: VirtualClock) -> None:
    async with host(identity("base")) as there:
        os.kill(pid := pid_of(there), signal.SIGSTOP)
        failed = await clock.advance_until(there.told(LinksFailed))
        assert "does not answer" in failed.problem.message
        await until_gone(pid)


async def test_process_ends_with_its_host_and_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    how: list[str] = []

    class Watched(LinksProcess):
        async def ended(self, grace_s: float) -> str:
            how.append(await super().ended(grace_s))
            return how[-1]

    monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=Watched))
    async with host(identity("base")) as there:
        pid = pid_of(there)
    assert not is_alive(pid)
    assert how[0] == "exited with status 0"


async def test_process_gains_no_privileges_and_is_refused_system_calls() -> None:
    async with host(identity("base")) as there:
        assert {"NoNewPrivs:\t1", "Seccomp:\t2"} <= status_of(pid_of(there))


async def test_strangers_have_time_only_while_the_loop_of_the_daemon_runs(
    clock: VirtualClock,
) -> None:
    """As its ticks tell."""
    async with serving() as daemon:

        async def ticked(seconds: float) -> list[Any]:
            await clock.stand_still(seconds)
            daemon.say("tick")
            return await daemon.hears()

        with socket.create_connection(("127.0.0.1", daemon.port)):
            while await ticked(0.0) != ["tock", 1]:
                pass
            for _ in range(3):
                assert await ticked(60.0) == ["tock", 1]
            spent_s = 0.0
            while (told := await ticked(BEAT_S)) == ["tock", 1] and spent_s < 2 * AWAITED_S:
                spent_s += BEAT_S
            assert told[:2] == ["refused", "silent"]


async def test_connection_without_descriptors_is_over_and_may_be_cut(clock: VirtualClock) -> None:
    async with serving() as daemon:
        with descriptors_left(0):
            daemon.say("dial", 1, KEY, ADDRESS)
            what, number, problem = await daemon.hears()
        assert (what, number, problem["code"]) == ("over", 1, "DIAL_IMPOSSIBLE")
        daemon.say("cut", 1, 0)
        daemon.say("tick")
        assert await daemon.hears() == ["tock", 0]


async def test_daemon_is_told_at_once_what_cannot_be_sent_to(clock: VirtualClock) -> None:
    """No time passes in which the process would look for what is over."""
    async with serving() as daemon:
        context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        with context.socket(zmq.DEALER) as peer:
            peer.linger = 0
            peer.connect(f"tcp://127.0.0.1:{daemon.port}")
            peer.send(b"hello")
            _, number, *_ = await daemon.hears()
            assert await daemon.hears() == ["data", number, b"hello"]
        context.destroy(linger=0)
        assert await daemon.hears() == ["doubtful", number]
        daemon.say("data", number, b"are you there?")
        await clock.advance(SECOND_LOOK_S)
        while (told := await daemon.hears()) == ["doubtful", number]:
            daemon.say("data", number, b"are you there?")
        assert told == ["over", number, None]


async def test_host_that_was_trusted_among_thousands_is_let_in() -> None:
    base, rover = identity("base"), identity("rover")
    many = {HostKeys.generate().public: "another host" for _ in range(3000)}
    trust = Trust(paired={**many, rover.key: "rover"})
    async with host(base) as there, host(rover, trusting(base)) as here:
        there.node.set_trust(trust)
        here.node.dial(there.key, [there.address])
        await up(here, there)


async def test_address_that_is_taken_is_told_and_another_may_be_tried() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        node = PeerNode(
            identity("base"),
            Trust(),
            Servant(),
            on_event=lambda _: None,
            sockets=hosts.SOCKETS,
        )
        with pytest.raises(PeerRefused, match="ADDRESS_UNUSABLE"):
            await node.start([address])
        assert await node.start(["tcp://127.0.0.1:0"])
        await node.close()


async def test_process_that_does_not_start_is_told(
    clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At once: no time passes that others would be given."""
    for start in (functools.partial(LinksProcess, memory=1024**2), no_process):
        monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=start))
        with pytest.raises(PeerRefused, match="LINKS_START"):
            async with host(identity("base")):
                pass


async def test_process_with_an_unwatchable_pipe_is_reported_and_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started: list[int] = []

    def start(pipe: socket.socket) -> LinksProcess:
        process = LinksProcess(pipe)
        started.append(process.pid)
        return process

    monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=start))
    with watches_left(1), pytest.raises(PeerRefused, match="LINKS_START"):  # for its end alone
        async with host(identity("base")):
            pass
    (pid,) = started
    assert not is_alive(pid)


STRANGE: Mapping[str, list[Any]] = {
    "unknown": ["sing"],
    "empty": [],
    "no number": ["data", "2", b""],
    "odd number": ["accepted", 3, "there", KEY],
    "number twice": ["accepted", 2, "there", KEY],
    "no key": ["accepted", 6, "there", ""],
    "unknown reason": ["misused", 2, "boredom"],
    "unknown refusal": ["refused", "boredom", "", "", ""],
    "no problem": ["over", 2, {"message": "a problem without code"}],
    "no count": ["taken", 2],
    "no one listens": ["listening", ["tcp://127.0.0.1:1"]],
    "no one listened": ["unusable", [{"code": "CODE", "message": "no one asked"}]],
}


@pytest.mark.parametrize("packet", STRANGE.values(), ids=STRANGE)
async def test_process_that_is_none_is_replaced(
    packet: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    puppets = Puppets()
    monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=puppets))
    async with host(identity("base"), address=ADDRESS) as there, asyncio.timeout(PATIENCE_S):
        (puppet,) = puppets.started
        puppet.say("accepted", 2, "there", KEY)
        puppet.say(*packet)
        assert (await there.told(LinksFailed)).problem.code == "LINKS_DIED"
        await until_async("another one was started", lambda: len(puppets.started) > 1)


async def test_connections_of_the_process_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    puppets = Puppets()
    monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=puppets))
    monkeypatch.setattr(sockets, "MOST_CONNECTIONS", 3)
    async with host(Identity("base", None), address=ADDRESS) as there:
        for number in (2, 4, 6, 8):
            assert there.events.empty()
            puppets.started[0].say("accepted", number, "there", "")
        await there.told(LinksFailed)


async def test_news_of_a_connection_that_was_cut_is_late_and_no_violation(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    puppets = Puppets()
    monkeypatch.setattr(hosts, "SOCKETS", functools.partial(SocketProcess, start=puppets))
    async with host(identity("base"), address=ADDRESS) as there:
        (puppet,) = puppets.started
        puppet.say("connected", 1)
        puppet.say("data", 1, b"late")
        puppet.say("refused", "silent", "10.0.0.7:1", "", "no peer: silent")
        await there.told(Refusal)
        assert len(puppets.started) == 1


def no_process(_pipe: socket.socket) -> LinksProcess:
    raise OSError("there are too many")


def pid_of(one: Host) -> int:
    assert one.node.links_pid is not None
    return one.node.links_pid


def status_of(pid: int) -> set[str]:
    return set(Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines())


def pushed(bad: zmq.Socket[bytes]) -> bool:
    """Send what can be sent without waiting."""
    while bad.poll(0, zmq.POLLOUT):
        bad.send(b"x" * MAX_MESSAGE)
    return True


def notify(there: Host, peer: PeerKey) -> bool:
    """Tell a peer something long; whether it is on its way, or waits."""
    try:
        there.node.notify(peer, "values", {"text": TEXT})
    except PeerUnreachable as full:
        assert full.code == "PEER_BUSY"
        return False
    return True


async def answers(one: Host, other: Host) -> None:
    """Wait until a call is answered, whatever becomes of links meanwhile."""
    call = functools.partial(one.node.call, other.key, "echo", {}, deadline_s=PATIENCE_S)
    await up(one, other)
    while await raises(call):
        await asyncio.sleep(0)  # where as many wait as may
        await up(one, other)
