"""Peers that send more than any host needs to are cut, and stay out for a while."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest
from tests.kit.clock import VirtualClock
from tests.transport.peers.hosts import Host, Servant, host, identity, raises, trusting, up

from nondum.transport.peers import Loss, PeerLost, PeerNode, PeerUp, Reason, allowance, peer_table
from nondum.transport.peers.allowance import LOOK_S, Allowance, Paced
from nondum.transport.peers.messages import Pong, Reply, encode
from nondum.transport.peers.session import Doubt

pytestmark = pytest.mark.anyio

FEW = Allowance(per_s=200.0, burst=50.0)


@pytest.fixture(autouse=True)
def _few_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(allowance, "WAITING", 100)


@pytest.fixture
async def narrow() -> AsyncIterator[tuple[Host, Host]]:
    """A rover, linked to a base that takes little."""
    rover, base = identity("rover"), identity("base")
    servant = Servant()
    node = PeerNode(
        base, trusting(rover), servant, on_event=lambda event: there.hear(event), allowance=FEW
    )
    there = Host(node, servant)
    (there.address,) = await node.start(["tcp://127.0.0.1:0"])
    async with host(rover, trusting(base)) as here:
        here.node.dial(there.key, [there.address])
        await up(here, there)
        yield here, there
    await node.close()


@pytest.mark.parametrize("what", ["calls", "notices"])
async def test_peer_that_floods_is_cut_and_not_let_in_again(
    what: str, narrow: tuple[Host, Host]
) -> None:
    rover, base = narrow
    for _ in range(250):
        if what == "calls":
            rover.node.call(base.key, "echo", {}, deadline_s=60)
        else:
            rover.node.notify(base.key, "values", {})
    assert (await base.told(PeerLost)).reason is Loss.VIOLATED
    assert (await rover.told(PeerLost)).reason is Loss.TURNED_AWAY
    await base.counted(Reason.FLOODING, 2)  # and when it came back
    assert rover.key not in base.node.peers


async def test_length_counts(narrow: tuple[Host, Host]) -> None:
    rover, base = narrow
    for _ in range(30):  # each as much as 7
        rover.node.notify(base.key, "values", {"text": "x" * 100_000})
    assert (await base.told(PeerLost)).reason is Loss.VIOLATED


async def test_peer_that_waits_for_answers_is_not_cut(narrow: tuple[Host, Host]) -> None:
    rover, base = narrow
    for number in range(4):
        calls = [rover.node.call(base.key, "echo", {"n": n}, deadline_s=60) for n in range(50)]
        assert [answer["n"] for answer in await asyncio.gather(*calls)] == list(range(50)), number
    assert base.node.refusals.counts == {}


async def test_what_is_more_than_allowed_is_handed_on_in_order_and_later(
    clock: VirtualClock,
) -> None:
    taken: list[int] = []
    paced = Paced(Allowance(per_s=10.0, burst=20.0).bucket(), taken.append)
    assert all([paced.take(number, cost=1) for number in range(100)])
    assert taken == list(range(20)), "at once"
    await clock.advance(LOOK_S)
    for second in (1, 2, 3):
        await clock.advance(1.0)
        assert taken == list(range(20 + 10 * second))
    paced.close()
    await clock.advance(60.0)
    assert len(taken) == 50


async def test_what_is_held_waits_in_order_until_it_is_released(clock: VirtualClock) -> None:
    taken: list[str] = []
    paced = Paced(Allowance(per_s=10.0, burst=4.0).bucket(), taken.append)
    assert paced.take("before", cost=1)
    paced.hold()
    assert all(paced.take(one, cost=1) for one in ("first", "second", "third"))
    assert paced.take("ping", cost=1, passes_held=True)
    await clock.advance(60.0)
    assert taken == ["before", "ping"]
    paced.release()
    await clock.advance(1.0)
    assert taken == ["before", "ping", "first", "second", "third"]


async def test_what_passes_by_those_held_is_paid_for_too(clock: VirtualClock) -> None:
    taken: list[int] = []
    paced = Paced(Allowance(per_s=1.0, burst=10.0).bucket(), taken.append)
    paced.hold()
    assert [paced.take(n, cost=1, passes_held=True) for n in range(111)] == [True] * 110 + [False]
    assert taken == list(range(10))


async def test_too_much_that_waits_is_refused(clock: VirtualClock) -> None:
    """Refused is what came too much; what waits is handed on."""
    taken: list[int] = []
    paced = Paced(Allowance(per_s=10.0, burst=10.0).bucket(), taken.append)
    assert [paced.take(number, cost=1) for number in range(111)] == [True] * 110 + [False]
    await clock.advance(10.0 + LOOK_S)
    assert taken == list(range(110))


async def test_halted_call_that_waits_to_be_taken_in_is_halted(
    narrow: tuple[Host, Host],
) -> None:
    rover, base = narrow
    for _ in range(100):
        rover.node.notify(base.key, "values", {})
    call = rover.node.call(base.key, "wait", {}, deadline_s=60)
    call.cancel()
    assert await raises(lambda: call) == ["HALTED"]


async def test_answers_are_free(narrow: tuple[Host, Host]) -> None:
    rover, base = narrow
    for _ in range(300):
        await base.node.call(rover.key, "echo", {"text": "x" * 1000}, deadline_s=5)
    assert base.node.refusals.counts == {}


async def test_answers_to_no_call_count_against_the_allowance(narrow: tuple[Host, Host]) -> None:
    rover, base = narrow
    session = rover.node._peer_table.session(base.key)
    for number in range(1, 251):
        session.send(encode(Reply(number, {})))
    assert (await base.told(PeerLost)).reason is Loss.VIOLATED
    await base.counted(Reason.FLOODING)


async def test_answers_to_other_pings_than_the_one_in_doubt_are_not_free(
    narrow: tuple[Host, Host],
) -> None:
    rover, base = narrow
    asked = base.node._peer_table.session(rover.key)
    asked.doubt = Doubt(ping=1_000, since_s=asyncio.get_running_loop().time())
    session = rover.node._peer_table.session(base.key)
    for _ in range(250):
        session.send(encode(Pong(1)))
    await base.counted(Reason.FLOODING)


async def test_flooding_peer_is_let_in_after_a_while(
    narrow: tuple[Host, Host], monkeypatch: pytest.MonkeyPatch
) -> None:
    rover, base = narrow
    monkeypatch.setattr(peer_table, "BARRED_S", 0.0)
    for _ in range(250):
        rover.node.notify(base.key, "values", {})
    await base.told(PeerLost)
    await base.told(PeerUp)


async def test_peer_that_greets_again_and_again_is_not_let_in(
    narrow: tuple[Host, Host],
) -> None:
    rover, base = narrow
    while await raises(lambda: rover.node.call(base.key, "echo", {}, deadline_s=5)) == []:
        for route in base.node.accepted:
            route.cut()
    await base.counted(Reason.FLOODING)
