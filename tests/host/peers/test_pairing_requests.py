"""Two hosts that are paired by their people, from the hints of the network to the trust on disk."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import zmq
from tests.host.peers.hints import Hinted, Network
from tests.kit.clock import VirtualClock

from nondum.host.peers.pairing_requests import LOOK_S, PairingRequests
from nondum.host.peers.trust_store import TRUST_NAME, PeerTrustStore
from nondum.transport.peers import HostKeys, PeerKey, PeerRefused, fingerprint
from nondum.transport.peers.pairing import Ask, Commit, Nonce
from nondum.transport.peers.pairing_messages import Beat, Said, decode, encode

pytestmark = pytest.mark.anyio

PATIENCE_S = 60.0
Row = dict[str, Any]


@dataclass
class Host:
    """A host that can be paired, and what the person at it sees."""

    trust_store: PeerTrustStore
    requests: PairingRequests
    rows: list[Row] = field(default_factory=list)
    news: asyncio.Event = field(default_factory=asyncio.Event)
    window: asyncio.Task[None] | None = None

    def begins(self, wanted: str | None = None) -> None:
        async def window() -> None:
            async with contextlib.aclosing(self.requests.pair(wanted)) as rows:
                async for row in rows:
                    self.rows.append(row)
                    self.news.set()

        self.rows.clear()
        self.window = asyncio.ensure_future(window())

    async def sees(self, step: str, holds: Callable[[Row], bool] = lambda row: True) -> Row:
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for row in self.rows:
                    if row["step"] == step and holds(row):
                        return row
                self.news.clear()
                await self.news.wait()

    async def leaves(self) -> None:
        if self.window is not None:
            self.window.cancel()
            await asyncio.wait({self.window})


@contextlib.asynccontextmanager
async def host(folder: Path, network: Network, name: str) -> AsyncIterator[Host]:
    trust_store = await PeerTrustStore.open(folder / name / "peers", name)
    requests = PairingRequests(
        trust_store, announce=network.tells(trust_store), candidates=network.all
    )
    found = Host(trust_store, requests)
    try:
        yield found
    finally:
        await found.leaves()


@pytest.fixture
async def pair(tmp_path: Path) -> AsyncIterator[tuple[Host, Host]]:
    network = Network()
    async with host(tmp_path, network, "rover") as rover, host(tmp_path, network, "base") as base:
        yield rover, base


async def test_people_who_say_yes_make_hosts_trust_each_other(pair: tuple[Host, Host]) -> None:
    rover, base = pair
    rover.begins()
    assert (await rover.sees("waiting"))["candidates"] == []
    base.begins()
    here, there = await rover.sees("comparing"), await base.sees("comparing")
    assert here["code"] == there["code"]
    assert (here["name"], here["fingerprint"]) == ("base", fingerprint(base.trust_store.key))
    assert (there["name"], there["fingerprint"]) == ("rover", fingerprint(rover.trust_store.key))
    rover.requests.confirm(here["code"])
    await rover.sees("confirmed")
    assert rover.trust_store.trust.paired == {}
    base.requests.confirm(there["code"])
    assert (await rover.sees("agreed"))["name"] == "base"
    await base.sees("agreed")
    for one, other in ((rover, base), (base, rover)):
        again = await PeerTrustStore.open(one.trust_store.folder, one.trust_store.host.name)
        assert again.trust.paired == {other.trust_store.key: other.trust_store.host.name}


async def test_code_is_told_once_whatever_host_is_found_meanwhile(
    tmp_path: Path, clock: VirtualClock
) -> None:
    """The host that is asked may hear of the other one only when both show the code."""
    network = Network()
    async with host(tmp_path, network, "rover") as rover, host(tmp_path, network, "base") as base:
        for one in (rover, base):
            one.begins()
        for one in (rover, base):
            await clock.advance_until(one.sees("comparing"))
        key = HostKeys.generate().public
        network.hints[key] = Hinted(key, "other", ("tcp://127.0.0.1:1",), 1)
        await clock.advance(2 * LOOK_S)
        for one in (rover, base):
            assert [row["step"] for row in one.rows].count("comparing") == 1


async def test_pairing_goes_on_when_the_other_host_is_found_at_one_more_address(
    tmp_path: Path, clock: VirtualClock
) -> None:
    network, at = Network(), ("tcp://127.0.0.1:7410",)
    async with host(tmp_path, network, "rover") as rover:
        with hand_played(after=rover.trust_store.key) as base:
            network.hints[base.keys.public] = Hinted(base.keys.public, "base", at, base.port)
            rover.begins()
            assert isinstance(await base.hears(), Ask)
            more = (*at, "tcp://127.0.0.2:7410")
            network.hints[base.keys.public] = Hinted(base.keys.public, "base", more, base.port)
            await clock.advance(2 * LOOK_S)
            base.says(Commit(base.keys.public, "base", b"c" * 32))
            assert isinstance(await base.hears(), Nonce)


class HandPlayed:
    """A host that is asked, and says what it is made to."""

    def __init__(self, context: zmq.Context[zmq.Socket[bytes]], keys: HostKeys) -> None:
        self.keys = keys
        self._socket = context.socket(zmq.ROUTER)
        self._socket.linger = 0
        self._socket.curve_server = True
        self._socket.curve_secretkey = keys.secret.encode("ascii")
        self._asker = b""
        self.port = self._socket.bind_to_random_port("tcp://127.0.0.1")

    async def hears(self) -> Said:
        """The next message that is not there for the connection's sake only."""
        said: Said = Beat()
        while isinstance(said, Beat):
            is_there = await asyncio.to_thread(self._socket.poll, int(PATIENCE_S) * 1000)
            assert is_there, "nothing was said"
            self._asker, data = self._socket.recv_multipart()
            said = decode(data)
        return said

    def says(self, message: Said) -> None:
        self._socket.send_multipart([self._asker, encode(message)])

    def close(self) -> None:
        self._socket.close(0)


@contextlib.contextmanager
def hand_played(*, after: PeerKey) -> Iterator[HandPlayed]:
    """One that is asked by the host with a key: its own comes after that."""
    keys = HostKeys.generate()
    while keys.public < after:
        keys = HostKeys.generate()
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    with contextlib.ExitStack() as ended:
        ended.callback(context.term)
        yield ended.enter_context(contextlib.closing(HandPlayed(context, keys)))


async def test_window_is_announced_while_it_is_open(tmp_path: Path) -> None:
    network = Network()
    async with host(tmp_path, network, "rover") as rover:
        rover.begins()
        await rover.sees("waiting")
        assert network.hints[rover.trust_store.key].pairing_port
        await rover.leaves()
        assert network.hints[rover.trust_store.key].pairing_port is None
        assert rover.requests.row() is None


async def test_no_of_one_person_is_told_to_both(pair: tuple[Host, Host]) -> None:
    rover, base = pair
    rover.begins()
    base.begins()
    await rover.sees("comparing")
    await base.sees("comparing")
    base.requests.refuse()
    for one in pair:
        assert (await one.sees("failed"))["problem"]["code"] == "PAIRING_REFUSED"
        assert one.trust_store.trust.paired == {}


async def test_person_who_leaves_closes_the_window(pair: tuple[Host, Host]) -> None:
    rover, base = pair
    rover.begins()
    base.begins()
    await rover.sees("comparing")
    await base.sees("comparing")
    await rover.leaves()
    gone = await base.sees("waiting", lambda row: row["problem"] is not None)
    assert gone["problem"]["code"] == "PAIRING_OVER"
    rover.begins()
    again = await rover.sees("comparing")
    assert (await base.sees("comparing", lambda row: row["code"] == again["code"]))[
        "name"
    ] == "rover"


async def test_one_of_several_hosts_is_named_by_the_person(tmp_path: Path) -> None:
    network = Network()
    names = ("rover", "base", "other")
    async with contextlib.AsyncExitStack() as stack:
        hosts = [await stack.enter_async_context(host(tmp_path, network, name)) for name in names]
        first, second, third = sorted(hosts, key=lambda one: one.trust_store.key)
        second.begins()
        third.begins()
        first.begins()
        seen = await first.sees("waiting", lambda row: len(row["candidates"]) == 2)
        assert {row["name"] for row in seen["candidates"]} == {
            second.trust_store.host.name,
            third.trust_store.host.name,
        }
        await first.leaves()
        first.begins(fingerprint(third.trust_store.key).lower())
        wanted = await first.sees("comparing")
        assert wanted["name"] == third.trust_store.host.name


async def test_host_that_is_not_the_named_one_is_not_compared(pair: tuple[Host, Host]) -> None:
    asking, asked = sorted(pair, key=lambda one: one.trust_store.key)
    asked.begins("somebody-else")
    asking.begins()
    told = await asking.sees("waiting", lambda row: row["problem"] is not None)
    assert told["problem"]["code"] == "PAIRING_UNWANTED"
    assert all(row["step"] == "waiting" for row in asked.rows)


async def test_host_with_the_name_of_a_paired_one_is_refused_until_that_is_forgotten(
    pair: tuple[Host, Host],
) -> None:
    rover, base = pair
    before = HostKeys.generate().public
    await rover.trust_store.pair(before, "base")
    rover.begins()
    base.begins()
    for one in pair:
        assert (await one.sees("failed"))["problem"]["code"] == "PAIRING_NAME"
        await one.leaves()
    await rover.trust_store.forget(before)
    rover.begins()
    base.begins()
    await rover.sees("comparing")


async def test_revoked_host_is_no_candidate(pair: tuple[Host, Host]) -> None:
    asking, asked = sorted(pair, key=lambda one: one.trust_store.key)
    await asked.trust_store.revoke(asking.trust_store.key, "stolen")
    asked.begins()
    asking.begins()
    await asking.sees("waiting", lambda row: row["problem"] is not None)
    assert all(row["candidates"] == [] for row in asked.rows)


async def test_second_window_is_refused(pair: tuple[Host, Host]) -> None:
    rover, _ = pair
    rover.begins()
    await rover.sees("waiting")
    with pytest.raises(PeerRefused, match="PAIRING_OPEN"):
        await anext(rover.requests.pair())
    assert rover.requests.row() is not None


async def test_nothing_is_said_where_no_window_is_open(pair: tuple[Host, Host]) -> None:
    rover, _ = pair
    with pytest.raises(PeerRefused, match="PAIRING_ORDER"):
        rover.requests.confirm("123 456")
    with pytest.raises(PeerRefused, match="PAIRING_ORDER"):
        rover.requests.refuse()


async def test_host_that_cannot_be_kept_is_not_paired(pair: tuple[Host, Host]) -> None:
    rover, base = pair
    (rover.trust_store.folder / TRUST_NAME).mkdir()
    rover.begins()
    base.begins()
    code = (await rover.sees("comparing"))["code"]
    await base.sees("comparing")
    base.requests.confirm(code)
    rover.requests.confirm(code)
    assert (await rover.sees("failed"))["problem"]["code"] == "PEERS_FOLDER"
    assert rover.trust_store.trust.paired == {}


async def test_hints_without_sense_harm_nothing(tmp_path: Path) -> None:
    """Whatever the network says: a host in development, an address that is none, this host."""
    network = Network()
    async with host(tmp_path, network, "rover") as rover, host(tmp_path, network, "base") as base:
        strange = PeerKey("development:x")
        network.hints[strange] = Hinted(strange, "x", ("tcp://127.0.0.1:1",), None)
        nowhere = HostKeys.generate().public
        network.hints[nowhere] = Hinted(nowhere, "nowhere", ("", "tcp://:", "x"), 1)
        rover.begins("base")
        base.begins("rover")
        assert (await rover.sees("comparing"))["name"] == "base"


async def test_development_is_refused(tmp_path: Path) -> None:
    trust_store = await PeerTrustStore.open(tmp_path, "rover")
    requests = PairingRequests(
        trust_store, announce=lambda _: None, candidates=lambda: (), is_development=True
    )
    with pytest.raises(PeerRefused, match="PAIRING_DEVELOPMENT"):
        await anext(requests.pair())
    assert requests.row() is None
