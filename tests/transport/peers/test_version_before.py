"""A host of the version before is a peer; one that shares no version with this one is turned away,
and both ends are told the reason.

What hosts of the version before said was recorded: `tests/data/version_before`.
"""

from __future__ import annotations

import asyncio

import pytest
from tests.kit import version_before
from tests.transport.peers.bad_ends import bad_router
from tests.transport.peers.dealers import hello_of, raw_dealer
from tests.transport.peers.hosts import PATIENCE_S, host, identity, trusting

from nondum.transport.peers import DialFailed, PeerUp, Reason, messages, peer_table
from nondum.transport.peers.messages import (
    Hello,
    Refused,
    Welcome,
    agreed_version,
    decode,
    encode,
)

LATER = 3
"""The only version that this host speaks, where it is to have none in common with another."""


@pytest.fixture(params=[1, 99], ids=["older", "newer"])
def foreign(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    """The version of a host with which this one has none in common."""
    for module in (messages, peer_table):
        monkeypatch.setattr(module, "VERSIONS", (LATER,))
    return int(request.param)


@pytest.mark.parametrize("name", ["before", "other"])
def test_each_message_of_the_version_before_is_read_and_written_alike(name: str) -> None:
    said = version_before.said(name)
    assert [encode(decode(data)) for data in said] == list(said)


def test_version_of_the_one_before_is_agreed_on() -> None:
    said = [decode(data) for name in ("before", "other") for data in version_before.said(name)]
    (hello,) = (message for message in said if isinstance(message, Hello))
    (welcome,) = (message for message in said if isinstance(message, Welcome))
    assert agreed_version(hello, "here") == agreed_version(welcome.hello, "here") == 1


@pytest.mark.anyio
async def test_host_of_the_version_before_is_told_nothing_that_it_does_not_know() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there:
        with raw_dealer(there, rover) as old:
            old.send(hello_of(rover, versions=(1,)))
            await there.told(PeerUp, rover.key)
            welcome = decode(await asyncio.to_thread(old.recv))
    assert isinstance(welcome, Welcome)
    assert welcome.hello.versions == (1,)


@pytest.mark.anyio
async def test_host_that_dials_with_a_foreign_version_is_told_the_reason(foreign: int) -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there, asyncio.timeout(PATIENCE_S):
        with raw_dealer(there, rover) as other:
            other.send(hello_of(rover, versions=(foreign,)))
            await there.counted(Reason.VERSION)
            refused = decode(await asyncio.to_thread(other.recv))
    (here,) = there.node.refusals.latest
    assert isinstance(refused, Refused)
    assert refused.problem == here.problem, "both ends are told the same"
    assert refused.problem.code == "PROTO_VERSION"
    assert (refused.problem.need, refused.problem.have) == (str(LATER), str(foreign))
    assert refused.problem.fix == f"update nondum on {'rover' if foreign < LATER else 'base'}"


@pytest.mark.anyio
async def test_host_that_answers_with_a_foreign_version_is_told_the_reason(foreign: int) -> None:
    base, rover = identity("base"), identity("rover")
    with bad_router(base) as (other, where):
        async with host(rover, trusting(base)) as here, asyncio.timeout(PATIENCE_S):
            here.node.dial(base.key, [where])
            routing_id, _ = await asyncio.to_thread(other.recv_multipart)
            greeting = Hello((foreign,), base.name, base.key, 7, 1, base.certificate)
            other.send_multipart([routing_id, encode(Welcome(greeting))])
            await here.counted(Reason.VERSION)
            _, told = await asyncio.to_thread(other.recv_multipart)
    refused = decode(told)
    assert isinstance(refused, Refused)
    assert refused.problem.code == "PROTO_VERSION"
    assert refused.problem.fix == f"update nondum on {'base' if foreign < LATER else 'rover'}"


@pytest.mark.anyio
async def test_refusal_of_the_version_before_is_shown() -> None:
    """It was given to a host that spoke a version of the future alone."""
    base, rover = identity("base"), identity("rover")
    (refusal,) = version_before.packets("refused")
    with bad_router(base) as (old, where):
        async with host(rover, trusting(base)) as here, asyncio.timeout(PATIENCE_S):
            here.node.dial(base.key, [where])
            routing_id, _ = await asyncio.to_thread(old.recv_multipart)
            old.send_multipart([routing_id, refusal])
            failed = await here.told(DialFailed)
    assert (failed.problem.code, failed.problem.need) == ("PROTO_VERSION", "1")
