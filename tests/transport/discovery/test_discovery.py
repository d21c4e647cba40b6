"""Hosts that look for each other by multicast, on this machine's loopback: there may be others."""

from __future__ import annotations

import asyncio
import os
from dataclasses import replace

import pytest
from tests.kit.until import PATIENCE_S, until_async
from tests.transport.discovery import spoofing
from tests.transport.discovery.hosts import Seeker, here, seeking

from nondum.transport.discovery import Announcement, Hint
from nondum.transport.discovery import interfaces as network
from nondum.transport.discovery.hint import MAX_ADDRESSES, instance, to_txt
from nondum.transport.discovery.hint_table import MAX_PEERS
from nondum.transport.discovery.multicast import Multicast
from nondum.transport.peers.keys import PeerKey

pytestmark = pytest.mark.anyio

LOOPBACK = ("127.0.0.1",)
LIAR, OTHER = here("liar"), here("other")
LIARS = {LIAR.key, OTHER.key}


async def until_refused(seeker: Seeker, code: str) -> None:
    await until_async(code, lambda: seeker.discovery.status().refused.get(code))


async def until_duplicate(seeker: Seeker) -> str:
    """Wait until it is told of another host with its key; where that is."""
    await until_async("a problem", lambda: seeker.discovery.status().problems)
    (problem,) = seeker.discovery.status().problems
    assert problem.code == "IDENTITY_DUPLICATE"
    return problem.message


def spoof(*packets: bytes) -> None:
    with spoofing.on_loopback() as stranger:
        for packet in packets:
            stranger.sendto(packet, spoofing.GROUP)


def spoofed(announcement: Announcement, *addresses: str, **changes: str) -> bytes:
    txt = {**to_txt(announcement), **changes}
    return spoofing.announced(instance(announcement.key), txt, addresses or ("127.0.0.1",))


async def test_hosts_find_each_other_in_both_directions() -> None:
    async with seeking(here("rover")) as rover, seeking(here("base")) as base:
        hint = await rover.found(base)
        assert hint.addresses == base.announcement.listening
        assert hint.name == "base"
        await base.found(rover)
        assert rover.announcement.key not in rover.discovery.hints


async def test_host_that_announces_itself_during_the_start_is_reported() -> None:
    """It announces itself again a second later, but zeroconf may drop that as a duplicate."""
    base, hints = here("base"), asyncio.Queue[Hint]()
    multicast = Multicast(
        base.security,
        on_hint=hints.put_nowait,
        on_gone=lambda key: None,
        on_refused=lambda problem: None,
    )
    loopback = network.loopback(network.read())
    starting = asyncio.create_task(multicast.reconcile(here("rover"), loopback))
    await asyncio.sleep(0)  # its sockets are open now, and it waits for what reads them
    spoof(spoofed(base))
    await starting
    try:
        async with asyncio.timeout(PATIENCE_S):
            while (await hints.get()).key != base.key:
                pass
    finally:
        await multicast.close()


async def test_a_goodbye_ends_the_hint() -> None:
    async with seeking(here("rover")) as rover:
        async with seeking(here("base")) as base:
            await rover.found(base)
        await rover.lost(base.announcement.key)
        assert base.announcement.key not in rover.discovery.hints


async def test_a_host_that_no_longer_announces_itself_is_gone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A killed host says no goodbye, and multicast DNS would keep it for an hour."""
    monkeypatch.setattr("nondum.transport.discovery.discovery.AGAIN_S", 0.1)
    monkeypatch.setattr("nondum.transport.discovery.discovery.SILENT_S", 1.0)
    killed = here("killed")
    async with seeking(here("rover")) as rover, seeking(here("base")) as base:
        await rover.found(base)
        spoof(spoofed(killed))
        await rover.told(lambda hint: hint.key == killed.key)
        await rover.lost(killed.key)
        assert killed.key not in rover.discovery.hints
        spoof(spoofed(killed))
        await rover.told(lambda hint: hint.key == killed.key)  # it is back, and unchanged


async def test_what_changes_is_told() -> None:
    base = here("base")
    async with seeking(here("rover")) as rover, seeking(base) as there:
        await rover.found(there)
        there.discovery.announce(replace(base, pairing_port=7411))
        await rover.told(lambda hint: hint.pairing_port == 7411)
        there.discovery.announce(base)
        await rover.told(lambda hint: hint.key == base.key and hint.pairing_port is None)


async def test_hosts_without_keys_find_only_each_other() -> None:
    async with (
        seeking(here("rover", key="development:rover")) as rover,
        seeking(here("base", key="development:base")) as base,
        seeking(here("secured")) as secured,
    ):
        await rover.found(base)
        await until_refused(rover, "HINT_SECURITY")
        await until_refused(secured, "HINT_SECURITY")
        assert secured.announcement.key not in rover.discovery.hints
        assert not {rover.announcement.key, base.announcement.key} & secured.discovery.hints.keys()


async def test_without_multicast_no_host_is_found() -> None:
    async with (
        seeking(here("rover")) as rover,
        seeking(here("quiet"), multicast=False) as quiet,
        seeking(here("base")) as base,
    ):
        await rover.found(base)
        assert quiet.announcement.key not in rover.discovery.hints
        assert quiet.discovery.hints == {}


async def test_a_copy_of_the_key_is_reported_by_both() -> None:
    rover = here("rover", epoch=1)
    copy = here("copy", epoch=2, key=rover.key)
    async with seeking(rover) as one, seeking(copy) as other:
        assert copy.listening[0] in await until_duplicate(one)
        assert rover.listening[0] in await until_duplicate(other)
        assert rover.key not in {**one.discovery.hints, **other.discovery.hints}


async def test_the_own_echo_is_no_copy() -> None:
    async with seeking(here("rover")) as rover, seeking(here("base")) as base:
        await base.found(rover)  # so the announcement has gone round
        assert rover.discovery.status().problems == ()


async def test_the_status_has_sent_and_received_announcements_by_interface() -> None:
    async with seeking(here("rover")) as rover, seeking(here("base")) as base:
        await rover.found(base)
        (row,) = (one for one in rover.discovery.status().interfaces if one.is_looked_on)
        assert (row.interface, row.heard >= 1, row.problem) == ("lo", True, None)
        assert row.announced_s is not None and row.heard_s is not None
        assert rover.discovery.status().hints >= 1


class TestStrangers:
    @pytest.mark.parametrize(
        ("packet", "code"),
        [
            (spoofed(LIAR, pk="~" * 40), "HINT_MALFORMED"),
            (spoofed(LIAR, epoch="no number"), "HINT_MALFORMED"),
            (spoofed(LIAR, pk=OTHER.key), "HINT_NAME"),
            (
                spoofing.announced("rover._nondum._tcp.local.", {"id": "x"}, ["127.0.0.1"]),
                "HINT_NAME",
            ),
            (
                spoofing.announced(instance(LIAR.key), b"\x03pk\xff", ["127.0.0.1"]),
                "HINT_MALFORMED",
            ),
            (spoofed(LIAR, "8.8.8.8", "224.0.0.1", "0.0.0.0"), "HINT_NOWHERE"),
        ],
        ids=["key", "epoch", "name of another key", "name of no key", "no text", "far away"],
    )
    async def test_lies_are_counted_and_harm_nothing(self, packet: bytes, code: str) -> None:
        async with seeking(here("rover")) as rover, seeking(here("base")) as base:
            spoof(packet)
            await until_refused(rover, code)
            await rover.found(base)
            assert not LIARS & rover.discovery.hints.keys()

    async def test_garbage_harms_nothing(self) -> None:
        good = spoofed(LIAR)
        garbage = [os.urandom(n) for n in (0, 1, 11, 12, 500, 8000)]
        cut = [good[:n] for n in range(0, len(good), 7)]
        async with seeking(here("rover")) as rover:
            spoof(*garbage, *cut)
            async with seeking(here("base")) as base:
                await rover.found(base)

    async def test_of_too_many_addresses_some_are_kept(self) -> None:
        async with seeking(here("rover")) as rover:
            spoof(spoofed(LIAR, *(f"127.0.0.{number}" for number in range(1, 100))))
            hint = await rover.told(lambda hint: hint.key == LIAR.key)
            assert len(hint.addresses) == MAX_ADDRESSES

    async def test_ten_thousand_invented_hosts_cost_a_bounded_number_of_hints(self) -> None:
        friend = here("friend")

        def prefers(key: PeerKey) -> bool:
            return key == friend.key

        async with seeking(here("rover"), prefers=prefers) as rover:
            with spoofing.on_loopback() as stranger:
                for number in range(10_000):
                    liar = Announcement(_invented(number), "liar", 1, ("tcp://[::]:7410",))
                    stranger.sendto(spoofed(liar), spoofing.GROUP)
                    # The kernel drops what comes too fast to be read: enough are read one by one.
                    if number < 4 * MAX_PEERS or number % 20 == 0:
                        await asyncio.sleep(0)
            await until_refused(rover, "HINT_CROWDED")
            assert len(rover.discovery.hints) == MAX_PEERS
            async with seeking(friend) as known:
                await rover.found(known)
            assert len(rover.discovery.hints) <= MAX_PEERS


def _invented(number: int) -> PeerKey:
    return PeerKey(f"{number:040d}")
