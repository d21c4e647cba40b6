"""What every fleet does, however its hosts reach each other."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator

import pytest
from tests.transport.fleet.fleets import MeshWorld, World, ZenohWorld
from tests.transport.peers.hosts import PATIENCE_S, raises

from nondum.sdk.errors import ProtocolViolation
from nondum.transport.fleet import EntryRefused, PeerChanged
from nondum.transport.fleet.chunk import MAX_ENTRY
from nondum.transport.peers import HostKeys, Lease, Loss, PeerLost, PeerUp

pytestmark = pytest.mark.anyio

CAMERA = {"component/camera": {"units": ["camera"], "rank": 1}}
LONG = {f"fact/{number}": {"text": "x" * 60_000} for number in range(8)}


@pytest.fixture(params=[MeshWorld, ZenohWorld], ids=["mesh", "zenoh"])
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    made: World = request.param()
    yield made
    made.close()


async def test_hosts_meet_and_read_each_other(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        rover.fleet.publish(CAMERA)
        await base.sees(rover, CAMERA)
        await rover.sees(base, {})
        peer = base.fleet.peers[rover.key]
        assert (peer.name, peer.epoch) == ("rover", rover.fleet.epoch)


async def test_late_host_reads_what_was_published_before(world: World) -> None:
    async with world.member("rover") as rover:
        rover.fleet.publish(CAMERA)
        async with world.member("base") as base:
            first = await base.told(PeerChanged)
            assert (first.key, first.is_whole, dict(first.changes)) == (rover.key, True, CAMERA)


async def test_changes_and_removals_follow(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        rover.fleet.publish(CAMERA | {"compute": {"free": 3}})
        await base.sees(rover, CAMERA | {"compute": {"free": 3}})
        rover.fleet.publish({"compute": {"free": 2}})
        await base.sees(rover, CAMERA | {"compute": {"free": 2}})
        rover.fleet.publish({"component/camera": None})
        await base.sees(rover, {"compute": {"free": 2}})
        last = [event for event in base.events if isinstance(event, PeerChanged)][-1]
        assert (dict(last.changes), last.is_whole) == ({"component/camera": None}, False)


async def test_long_catalogue_comes_at_once(world: World) -> None:
    """Several messages, one event: no subscriber sees half of it."""
    async with world.member("rover") as rover:
        rover.fleet.publish(LONG)
        async with world.member("base") as base:
            assert (await base.told(PeerChanged)).changes == LONG
            longer = {key: {"text": "y" * 60_000} for key in LONG}
            rover.fleet.publish(longer)
            assert (await base.told(PeerChanged)).changes == longer


async def test_burst_of_changes_is_told_as_one(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        await base.sees(rover, {})
        for number in range(50):
            rover.fleet.publish({f"fact/{number}": {"holds": True}})
        await base.sees(rover, {f"fact/{number}": {"holds": True} for number in range(50)})
        changes = [event for event in base.events if isinstance(event, PeerChanged)]
        assert len(changes) == 2


async def test_entry_that_fits_no_message_is_refused_by_name(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        with pytest.raises(EntryRefused, match=r"ENTRY_TOO_LONG fact/long") as refused:
            rover.fleet.publish(CAMERA | {"fact/long": {"text": "x" * MAX_ENTRY}})
        assert refused.value.problems[0].where == "fact/long"
        with pytest.raises(ProtocolViolation):
            rover.fleet.publish({"fact/odd": {"value": float("nan")}})
        rover.fleet.publish({"fact/longest": {"t": "x" * (MAX_ENTRY - 8)}})
        await base.sees(rover, {"fact/longest": {"t": "x" * (MAX_ENTRY - 8)}})


async def test_departure_takes_the_catalogue_along(world: World) -> None:
    async with world.member("base") as base:
        async with world.member("rover") as rover:
            rover.fleet.publish(CAMERA)
            await base.sees(rover, CAMERA)
        lost = await base.told(PeerLost)
        assert (lost.key, lost.reason) == (rover.key, Loss.DEPARTED)
        assert rover.key not in base.fleet.peers


async def test_catalogue_of_a_restarted_host_is_read_again(world: World) -> None:
    keys = HostKeys.generate()
    async with world.member("base") as base:
        async with world.member("rover", keys) as before:
            before.fleet.publish(CAMERA)
            await base.sees(before, CAMERA)
        async with world.member("rover", keys) as after:
            await base.told(PeerLost)
            assert (await base.told(PeerUp)).epoch == after.fleet.epoch != before.fleet.epoch
            after.fleet.publish({"compute": {"free": 1}})
            await base.sees(after, {"compute": {"free": 1}})


async def test_killed_host_is_lost_and_can_come_back(world: World) -> None:
    keys = HostKeys.generate()
    async with world.member("base") as base:
        with world.child("rover", keys, CAMERA) as process:
            await base.sees(keys.public, CAMERA)
            first = base.fleet.peers[keys.public].epoch
            call = base.fleet.call(keys.public, "wait", {}, deadline_s=600)
            process.kill()
            assert (await base.told(PeerLost)).key == keys.public
            assert await raises(lambda: call) == ["PEER_LOST"]
        with world.child("rover", keys, {"compute": {"free": 1}}):
            await base.sees(keys.public, {"compute": {"free": 1}})
            assert base.fleet.peers[keys.public].epoch != first


async def test_calls_are_answered_with_progress(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        up = await base.told(PeerUp)
        call = base.fleet.call(up.key, "count", {"to": 5}, deadline_s=20)
        assert [body["number"] async for body in call] == [0, 1, 2, 3, 4]
        assert await call == {"counted": 5}
        assert rover.servant.served == ["count"]


async def test_failing_call_tells_why(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        await base.told(PeerUp)
        for method, code in [("nothing", "NO_METHOD"), ("break", "INTERNAL")]:
            call = base.fleet.call(rover.key, method, {}, deadline_s=20)
            assert await raises(lambda c=call: c) == [code]  # type: ignore[misc]  # c is bound


async def test_call_is_cancelled_and_has_a_deadline(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        await base.told(PeerUp)
        call = base.fleet.call(rover.key, "wait", {}, deadline_s=600)
        await asyncio.wait_for(rover.servant.running.get(), PATIENCE_S)
        call.cancel()
        assert await raises(lambda: call) == ["HALTED"]
        assert await rover.servant.ended.get() == "cancelled"
        late = base.fleet.call(rover.key, "wait", {}, deadline_s=0.05)
        assert await raises(lambda: late) == ["DEADLINE"]
        assert await asyncio.wait_for(rover.servant.ended.get(), PATIENCE_S) == "cancelled"


@pytest.mark.parametrize(
    ("lease", "outcome"), [(Lease.STOP, "cancelled"), (Lease.FINISH, "finished")], ids=str
)
async def test_call_of_a_lost_caller_follows_its_lease(
    world: World, lease: Lease, outcome: str
) -> None:
    async with world.member("rover") as rover:
        rover.servant.lease = lease
        async with world.member("base") as base:
            await base.told(PeerUp)
            base.fleet.call(rover.key, "wait", {}, deadline_s=600)
            await asyncio.wait_for(rover.servant.running.get(), PATIENCE_S)
        assert await asyncio.wait_for(rover.servant.lost.get(), PATIENCE_S) is Loss.DEPARTED
        rover.servant.gate.set()
        assert await asyncio.wait_for(rover.servant.ended.get(), PATIENCE_S) == outcome


async def test_notices_reach_the_handler_except_those_of_the_fleet_itself(world: World) -> None:
    async with world.member("rover") as rover, world.member("base") as base:
        await base.told(PeerUp)
        base.fleet.notify(rover.key, "fleet.nothing", {})
        base.fleet.notify(rover.key, "hello", {"a": 1})
        heard = await asyncio.wait_for(rover.servant.notices.get(), PATIENCE_S)
        assert heard == {"from": "base", "method": "hello", "a": 1}
        call = base.fleet.call(rover.key, "fleet.nothing", {}, deadline_s=20)
        assert await raises(lambda: call) == ["NO_METHOD"]
        assert rover.servant.served == []


async def test_twenty_hosts_converge(world: World) -> None:
    async with contextlib.AsyncExitStack() as stack:
        members = []
        for number in range(20):
            member = await stack.enter_async_context(world.member(f"host-{number}"))
            member.fleet.publish({"self": {"number": number}})
            members.append(member)
        for one in members:
            for number, other in enumerate(members):
                if one is not other:
                    await one.sees(other, {"self": {"number": number}})
        members[0].fleet.publish({"self": None, "more": {"number": 100}})
        for one in members[1:]:
            await one.sees(members[0], {"more": {"number": 100}})
