"""What waits for a peer that does not read is bounded, and its loss alone."""

from __future__ import annotations

import asyncio

import pytest
from tests.kit.clock import VirtualClock
from tests.transport.peers.bad_ends import bad_dealer, hello_of
from tests.transport.peers.hosts import Host, host, identity, raises, trusting, up

from nondum.transport.peers import PeerKey, PeerUnreachable, PeerUp
from nondum.transport.peers.listener import HIGH_WATER

pytestmark = pytest.mark.anyio

TEXT = "x" * 100_000
KERNELS = (4 + 6 + 6) * 10
"""Messages that lie in buffers of both kernels: tcp_wmem, tcp_rmem, and a margin (tcp(7))."""
TRIES = 3000


async def test_peer_that_does_not_read_is_told_no_more_than_may_wait(clock: VirtualClock) -> None:
    base, deaf, other = identity("base"), identity("deaf"), identity("other")
    async with host(base, trusting(deaf, other)) as there, host(other, trusting(base)) as good:
        good.node.dial(there.key, [there.address])
        await up(good, there)
        with bad_dealer(there.address, deaf, there, most_read=1) as bad:
            bad.send(hello_of(deaf))
            await there.told(PeerUp, deaf.key)
            taken = 0
            for _ in range(TRIES):
                taken += notify(there, deaf.key)
                await asyncio.sleep(0)
            assert HIGH_WATER // 2 < taken <= HIGH_WATER + KERNELS
            call = there.node.call
            assert await raises(lambda: call(deaf.key, "echo", {"text": TEXT}, deadline_s=1)) == [
                "PEER_BUSY"
            ]
            assert await call(good.key, "echo", {"n": 1}, deadline_s=60) == {"n": 1}
            there.node.notify_all("values", {})  # it misses that, the other one does not
            assert (await good.servant.notices.get())["method"] == "values"


def notify(there: Host, peer: PeerKey) -> bool:
    """Tell a peer something long; whether it is on its way, or waits."""
    try:
        there.node.notify(peer, "values", {"text": TEXT})
    except PeerUnreachable as full:
        assert full.code == "PEER_BUSY"
        return False
    return True
