"""What is particular to a fleet by way of a router: the router comes and goes, and is believed."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import sys
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
import zenoh
from tests.kit.clock import VirtualClock
from tests.kit.until import until_async
from tests.transport.fleet.fleets import (
    PATIENCE_S,
    Member,
    ZenohWorld,
    refusals,
    router,
    zenoh_member,
)

from nondum.transport.fleet import PeerChanged
from nondum.transport.peers import (
    DialFailed,
    HostKeys,
    Loss,
    PeerLost,
    PeerRefused,
    PeerUp,
    Reason,
    Security,
    Trust,
)
from nondum.transport.peers.messages import Message, Ping, Pong, Reply, decode
from nondum_host_zenoh.fleet import STATE_S
from nondum_host_zenoh.line import RouterAccess
from nondum_host_zenoh.node import SILENCE_S, TERMS

pytestmark = pytest.mark.anyio


@pytest.fixture
def world() -> Iterator[ZenohWorld]:
    made = ZenohWorld()
    yield made
    made.close()


@contextlib.contextmanager
def overheard(world: ZenohWorld) -> Iterator[asyncio.Queue[Message]]:
    """What goes by way of the router, from now on."""
    loop, messages = asyncio.get_running_loop(), asyncio.Queue[Message]()

    def take(sample: zenoh.Sample) -> None:
        loop.call_soon_threadsafe(messages.put_nowait, decode(sample.payload.to_bytes()))

    subscriber = world.router.declare_subscriber("nondum/test/**", take)
    yield messages
    subscriber.undeclare()  # type: ignore[no-untyped-call]  # so it is in Zenoh's stubs


@contextlib.asynccontextmanager
async def started(
    world: ZenohWorld, name: str, keys: HostKeys | None, trust: Trust
) -> AsyncIterator[Member]:
    fleet, member = zenoh_member(name, keys, trust, world.access)
    await fleet.start()
    try:
        yield member
    finally:
        await fleet.close()


async def test_router_that_restarts_loses_nothing_for_good(world: ZenohWorld) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        rover.fleet.publish({"fact/a": {"holds": True}})
        await base.sees(rover, {"fact/a": {"holds": True}})
        world.close()
        assert (await base.told(PeerLost)).reason is Loss.DISCONNECTED
        rover.fleet.publish({"fact/a": None, "fact/b": {"holds": True}})
        world.router = router(world.port)
        await base.sees(rover, {"fact/b": {"holds": True}})
        assert (await base.told(PeerChanged)).is_whole


async def test_hosts_that_tell_all_are_not_pinged(world: ZenohWorld, clock: VirtualClock) -> None:
    """With n hosts, pings would be n times as much as all that is told."""
    async with world.member("rover") as rover, world.member("base") as base:
        await base.told(PeerUp)
        with overheard(world) as said:
            for n in range(5):
                for one in (rover, base):
                    one.fleet.publish({"count": {"is": n}})
                await clock.advance(STATE_S)
                for one, other in ((rover, base), (base, rover)):
                    await one.sees(other, {"count": {"is": n}})
            call = base.fleet.call(rover.key, "echo", {"is": "the end"}, deadline_s=PATIENCE_S)
            assert await call == {"is": "the end"}
            messages = [await said.get()]
            while not (isinstance(last := messages[-1], Reply) and last.body == await call):
                messages.append(await said.get())
        assert not [message for message in messages if isinstance(message, Ping | Pong)]


def test_host_doubts_when_it_has_told_nothing_and_before_it_is_given_up() -> None:
    assert STATE_S < TERMS.doubt_s(0.0) < TERMS.limit_s(0.0) == SILENCE_S


async def test_router_that_is_late_is_waited_for(world: ZenohWorld) -> None:
    world.close()
    async with world.member("rover") as rover, world.member("base") as base:
        assert [problem.code for problem in base.fleet.problems] == ["ROUTER_UNREACHED"]
        world.router = router(world.port)
        assert (await base.told(PeerUp)).key == rover.key
        assert not base.fleet.problems


async def test_router_that_is_gone_is_missed_until_it_is_back(world: ZenohWorld) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        await base.told(PeerUp)
        world.close()
        assert (await base.told(PeerLost)).key == rover.key
        await until_async("the router is missed", lambda: base.fleet.problems)
        assert base.fleet.problems[0].code == "ROUTER_UNREACHED"
        world.router = router(world.port)
        assert (await base.told(PeerUp)).key == rover.key
        assert not base.fleet.problems


async def test_routers_word_is_told_as_such(world: ZenohWorld) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        assert (await base.told(PeerUp)).admitted_by == "router"
        assert rover.fleet.security is Security.ROUTER


async def test_host_without_trust_is_turned_away(world: ZenohWorld) -> None:
    rover, stranger = HostKeys.generate(), HostKeys.generate()
    both = Trust(paired={rover.public: "rover", stranger.public: "stranger"})
    for trusted, other in [(rover, stranger), (stranger, rover)]:
        async with (
            started(world, "one", trusted, Trust()) as one,
            started(world, "two", other, both) as two,
        ):
            if trusted.public < other.public:
                continue  # a host that trusts no key greets no host
            await one.until(lambda: bool(refusals(one)))
            assert refusals(one)[0].reason is Reason.UNKNOWN_KEY
            assert (await two.told(DialFailed)).problem.code == "KEY_UNKNOWN"
            assert not one.fleet.peers


async def test_second_host_of_a_name_is_kept_out(world: ZenohWorld) -> None:
    keys = sorted((HostKeys.generate() for _ in range(3)), key=lambda pair: pair.public)
    trust = Trust(paired={pair.public: "base" for pair in keys[:2]} | {keys[2].public: "rover"})
    async with (
        started(world, "rover", keys[2], trust) as rover,
        started(world, "base", keys[0], trust) as first,
    ):
        await rover.told(PeerUp)
        async with started(world, "base", keys[1], trust) as second:
            assert (await second.told(DialFailed)).problem.code == "PEER_NAME_TAKEN"
            assert set(rover.fleet.peers) == {first.key}


async def test_peer_with_a_revoked_key_is_cut(world: ZenohWorld) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        await base.told(PeerUp)
        fleet = world.members[1]
        fleet.set_trust(Trust(paired=dict(world.names)).with_revoked(rover.key, "stolen"))
        assert (await base.told(PeerLost)).reason is Loss.REVOKED
        assert (await rover.told(PeerLost)).reason is Loss.TURNED_AWAY


async def test_peer_that_is_no_longer_trusted_is_cut(world: ZenohWorld) -> None:
    """Nothing that it says is waited for."""
    async with world.member("rover"), world.member("base") as base:
        await base.told(PeerUp)
        world.members[1].set_trust(Trust())
        assert (await base.told(PeerLost)).reason is Loss.REVOKED


def test_host_without_zenoh_is_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "zenoh", None)
    access = RouterAccess("test", ("tls/10.0.0.1:7447",), Path("ca.pem"))
    with pytest.raises(PeerRefused, match="ZENOH_MISSING"):
        access.to_config()


async def test_hosts_without_keys_use_a_router_on_this_machine_only(world: ZenohWorld) -> None:
    async with (
        started(world, "rover", None, Trust()) as rover,
        started(world, "base", None, Trust()) as base,
    ):
        assert (await base.told(PeerUp)).admitted_by == "development"
        assert rover.fleet.security is Security.DEVELOPMENT
    away = RouterAccess("test", ("tcp/192.0.2.1:7447",))
    with pytest.raises(PeerRefused, match="DEVELOPMENT_LOOPBACK"):
        zenoh_member("rover", None, Trust(), away)


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"fleet": "a/*"}, "FLEET_NAME"),
        ({"fleet": ""}, "FLEET_NAME"),
        ({"endpoints": ()}, "ADDRESS_MALFORMED"),
        ({"endpoints": ("tcp://10.0.0.1:7447",)}, "ADDRESS_MALFORMED"),
        ({"endpoints": ("tls/10.0.0.1:7447#",)}, "ADDRESS_MALFORMED"),
    ],
    ids=str,
)
async def test_access_that_cannot_work_is_refused(wrong: dict[str, object], code: str) -> None:
    access = RouterAccess("test", ("tls/10.0.0.1:7447",), Path("ca.pem"))
    zenoh_member("rover", HostKeys.generate(), Trust(), access)
    with pytest.raises(PeerRefused, match=code):
        zenoh_member(
            "rover",
            HostKeys.generate(),
            Trust(),
            dataclasses.replace(access, **wrong),  # type: ignore[arg-type]  # as written above
        )
