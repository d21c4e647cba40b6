"""Which hosts dial which: real nodes, and hints that may be wrong, late, or gone."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence

import pytest
from tests.transport.fleet.fleets import Member, mesh_member, refusals

from nondum.sdk.wire import Body
from nondum.transport.fleet import Mesh, PeerChanged
from nondum.transport.fleet.dialling import ADDRESSES, AT_ONCE, WISHES, DialPolicy
from nondum.transport.peers import (
    DialFailed,
    HostKeys,
    Loss,
    PeerKey,
    PeerLost,
    PeerNode,
    PeerRefused,
    PeerUp,
    Reason,
    Trust,
)

pytestmark = pytest.mark.anyio


def pairs(*names: str) -> list[tuple[str, HostKeys]]:
    """Hosts to be, the one with the smallest key first."""
    keys = sorted((HostKeys.generate() for _ in names), key=lambda pair: pair.public)
    return list(zip(names, keys, strict=True))


def trust_in(hosts: Sequence[tuple[str, HostKeys]]) -> Trust:
    return Trust(paired={keys.public: name for name, keys in hosts})


@contextlib.asynccontextmanager
async def started(
    host: tuple[str, HostKeys | None], trust: Trust
) -> AsyncIterator[tuple[Mesh, Member]]:
    mesh, member = mesh_member(*host, trust)
    await mesh.start()
    try:
        yield mesh, member
    finally:
        await mesh.close()


class SlowFinder:
    """A finder whose `close` waits for `may_close`, as multicast takes time to say goodbye."""

    def __init__(self) -> None:
        self.may_close = asyncio.Event()

    async def start(self) -> None:
        """Begin to look."""

    async def close(self) -> None:
        await self.may_close.wait()


async def test_peers_hear_of_a_departure_before_the_finder_has_ended() -> None:
    hosts, finder = pairs("rover", "base"), SlowFinder()
    trust = trust_in(hosts)
    mesh, rover = mesh_member(*hosts[0], trust, find=lambda mesh: finder)
    await mesh.start()
    async with started(hosts[1], trust) as (base, told):
        mesh.meet(base.key, base.addresses)
        await told.told(PeerUp)
        await rover.told(PeerUp)  # before, it has no peer to say goodbye to
        closing = asyncio.create_task(mesh.close())
        assert (await told.told(PeerLost)).reason is Loss.DEPARTED
        finder.may_close.set()
        await closing


@pytest.mark.parametrize("dialler", [0, 1], ids=["smaller key", "bigger key"])
async def test_either_host_can_be_the_one_that_knows(dialler: int) -> None:
    """Perhaps only one direction works."""
    hosts = pairs("rover", "base")
    trust = trust_in(hosts)
    async with (
        started(hosts[dialler], trust) as (one, told),
        started(hosts[1 - dialler], trust) as (other, _),
    ):
        one.meet(other.key, other.addresses)
        assert (await told.told(PeerUp)).key == other.key


async def test_two_hosts_that_know_each_other_have_one_link() -> None:
    hosts = pairs("rover", "base")
    trust = trust_in(hosts)
    async with (
        started(hosts[0], trust) as (rover, told),
        started(hosts[1], trust) as (base, also_told),
    ):
        base.meet(rover.key, rover.addresses)
        rover.meet(base.key, base.addresses)
        assert (await told.told(PeerUp)).address == base.addresses[0]
        assert (await also_told.told(PeerUp)).address not in rover.addresses


async def test_wrong_hint_does_not_keep_hosts_apart() -> None:
    hosts = pairs("rover", "base", "other")
    trust = trust_in(hosts)
    async with (
        started(hosts[0], trust) as (rover, told),
        started(hosts[1], trust) as (base, _),
        started(hosts[2], trust) as (other, _),
    ):
        rover.meet(base.key, [*other.addresses, "tcp://127.0.0.1:1"])
        assert (await told.told(DialFailed)).key == base.key
        rover.meet(base.key, base.addresses)
        assert (await told.told(PeerUp)).key == base.key


async def test_hint_without_trust_is_not_followed() -> None:
    hosts = pairs("rover", "stranger")
    async with (
        started(hosts[0], Trust()) as (rover, told),
        started(hosts[1], trust_in(hosts)) as (stranger, heard),
    ):
        rover.meet(stranger.key, stranger.addresses)
        rover.meet(rover.key, rover.addresses)
        rover.set_trust(trust_in(hosts))
        rover.meet(stranger.key, stranger.addresses)
        await told.told(PeerUp)
        assert not refusals(heard)
        assert not refusals(told)
        rover.set_trust(Trust())
        assert (await told.told(PeerLost)).reason is Loss.REVOKED


async def test_link_outlives_the_hint() -> None:
    hosts = pairs("rover", "base")
    trust = trust_in(hosts)
    async with started(hosts[0], trust) as (rover, told), started(hosts[1], trust) as (base, _):
        rover.meet(base.key, base.addresses)
        await told.told(PeerUp)
        rover.no_more_hints(base.key)
        answer = rover.call(base.key, "echo", {"a": 1}, deadline_s=20)
        assert await answer == {"a": 1}


async def test_host_without_hints_is_found_where_it_was() -> None:
    hosts = pairs("rover", "base")
    trust = trust_in(hosts)
    async with started(hosts[0], trust) as (rover, told):
        async with started(hosts[1], trust) as (base, _):
            rover.meet(base.key, base.addresses)
            await told.told(PeerUp)
            rover.no_more_hints(base.key)
            port = base.addresses[0]
        await told.told(PeerLost)
        again, _ = mesh_member(*hosts[1], trust, listen=port)
        await again.start()
        try:
            assert (await told.told(PeerUp)).epoch == again.epoch
        finally:
            await again.close()


async def test_second_host_of_a_name_is_kept_out() -> None:
    hosts = pairs("rover", "base", "base")
    trust = trust_in(hosts)
    async with (
        started(hosts[0], trust) as (rover, told),
        started(hosts[1], trust) as (first, _),
        started(hosts[2], trust) as (second, heard),
    ):
        rover.meet(first.key, first.addresses)
        await told.told(PeerUp)
        rover.meet(second.key, second.addresses)
        await told.until(lambda: bool(refusals(told)))
        refused = refusals(told)[0]
        assert refused.reason is Reason.DUPLICATE
        assert refused.told.startswith("PEER_NAME_TAKEN base")
        assert set(rover.peers) == {first.key}
        await heard.until(lambda: bool(heard.events))


async def test_host_of_this_hosts_name_is_kept_out() -> None:
    hosts = pairs("base", "base")
    trust = trust_in(hosts)
    async with started(hosts[0], trust) as (one, told), started(hosts[1], trust) as (other, also):
        one.meet(other.key, other.addresses)
        assert (await told.told(DialFailed)).problem.code == "PEER_NAME_TAKEN"
        problem = refusals(also)[0].problem
        assert problem is not None and (problem.code, problem.where) == ("PEER_NAME_TAKEN", "base")
        assert not one.peers
        assert not other.peers


async def test_address_that_cannot_be_dialled_is_refused() -> None:
    (host,) = pairs("rover")
    async with started(host, Trust()) as (rover, _):
        with pytest.raises(PeerRefused, match="ADDRESS_MALFORMED"):
            rover.meet(PeerKey("development:base"), ["udp://127.0.0.1:1"])
        with pytest.raises(PeerRefused, match="ADDRESS_MALFORMED"):
            rover.check_address("udp://127.0.0.1:1")


async def test_hosts_without_keys_meet_on_this_machine() -> None:
    async with (
        started(("rover", None), Trust()) as (rover, told),
        started(("base", None), Trust()) as (base, _),
    ):
        base.publish({"fact/a": {"holds": True}})
        rover.meet(base.key, base.addresses)
        assert (await told.told(PeerChanged)).changes == {"fact/a": {"holds": True}}
        with pytest.raises(PeerRefused, match="DEVELOPMENT_LOOPBACK"):
            rover.meet(base.key, ["tcp://192.0.2.1:7410"])


class Dialled:
    """Notes what a policy wants, for tests with more hosts than can be reached."""

    def __init__(self) -> None:
        self.dials: dict[PeerKey, tuple[str, ...]] = {}

    def dial(self, peer: PeerKey, addresses: Sequence[str]) -> None:
        self.dials[peer] = tuple(addresses)

    def hang_up(self, peer: PeerKey) -> None:
        self.dials.pop(peer, None)


async def test_strangers_hints_are_bounded() -> None:
    dialled = Dialled()
    meeting = DialPolicy(PeerKey("a"), dialled, lambda key: True)
    for number in range(3 * WISHES):
        many = [f"tcp://10.0.{number % 200}.{last}:1" for last in range(100)]
        meeting.hinted(PeerKey(f"b{number}"), many)
    assert len(dialled.dials) == AT_ONCE
    for number in range(3 * WISHES):
        meeting.turn_over(PeerKey(f"b{number}"))
    assert len(dialled.dials) == WISHES
    assert all(len(addresses) == ADDRESSES for addresses in dialled.dials.values())
    meeting.close()


async def test_a_closed_policy_dials_no_host() -> None:
    """A finder may give hints until it has ended, too."""
    dialled = Dialled()
    meeting = DialPolicy(PeerKey("a"), dialled, lambda key: True)
    meeting.close()
    meeting.hinted(PeerKey("b"), ["tcp://10.0.0.1:1"])
    assert not dialled.dials
    assert not meeting.looked_for


async def test_host_that_was_met_keeps_its_place_among_strangers() -> None:
    dialled = Dialled()
    meeting = DialPolicy(PeerKey("a"), dialled, lambda key: True)
    met = PeerKey("base")
    meeting.hinted(met, ["tcp://10.0.0.1:1"])
    meeting.up(PeerUp(met, "base", 1, "tcp://10.0.0.1:1", "pairing"))
    meeting.lost(met)
    meeting.hinted(met, ["tcp://10.6.6.6:1"])
    for number in range(2 * WISHES):
        meeting.hinted(PeerKey(f"b{number}"), ["tcp://10.0.0.2:1"])
    meeting.gone(met)
    meeting.turn_over(next(iter(dialled.dials)))
    assert dialled.dials[met] == ("tcp://10.0.0.1:1",)
    meeting.close()


@pytest.mark.parametrize(
    ("method", "body"),
    [("fleet.changed", {}), ("fleet.changed", {"epoch": 1}), ("fleet.state", {"digest": 1})],
    ids=str,
)
async def test_odd_notice_has_its_host_cut(method: str, body: Body) -> None:
    hosts = pairs("rover", "liar")
    trust = trust_in(hosts)
    async with started(hosts[0], trust) as (rover, told), started(hosts[1], trust) as (liar, met):
        rover.meet(liar.key, liar.addresses)
        await met.told(PeerUp)
        liar.notify(rover.key, method, body)
        await told.until(lambda: bool(refusals(told)))
        assert refusals(told)[0].reason is Reason.GARBAGE


async def test_lost_news_is_found_by_the_next_ping(monkeypatch: pytest.MonkeyPatch) -> None:
    """As when the peer could take no more messages just then."""
    hosts = pairs("rover", "base")
    trust = trust_in(hosts)
    async with started(hosts[0], trust) as (rover, told), started(hosts[1], trust) as (base, _):
        rover.meet(base.key, base.addresses)
        await told.sees(base.key, {})
        monkeypatch.setattr(PeerNode, "notify_all", lambda *_: None)
        base.publish({"fact/a": {"holds": True}})
        await told.sees(base.key, {"fact/a": {"holds": True}})
