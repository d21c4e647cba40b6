"""Processes that have few descriptors left: they are refused what takes some, and go on."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
from collections.abc import AsyncIterator
from typing import Any

import pytest
import zmq
from tests.kit.clock import VirtualClock
from tests.kit.descriptors import descriptors_left, open_descriptors
from tests.kit.until import until_async
from tests.kit.watches import watches_left
from tests.transport.peers import scarcity
from tests.transport.peers.hosts import PATIENCE_S, ROOT, host, identity, trusting, up

from nondum.sdk.errors import Problem
from nondum.transport.peers import HostKeys, PeerRefused, Reason, descriptors
from nondum.transport.peers.events import DialFailed
from nondum.transport.peers.listener import Context, dialling, listening
from nondum.transport.peers.local_sockets import LOOK_S
from nondum.transport.peers.monitor import Watch
from nondum.transport.peers.pairing_listener import PairingListener
from nondum.transport.peers.refusals import Refusals
from nondum.transport.peers.routes import DialledRoute
from nondum.transport.peers.zap import Entry, ZapHandler

pytestmark = pytest.mark.anyio

KEYS = HostKeys.generate()
LEFT = range(descriptors.FIRST_SOCKETS + 3)
"""From none to more than are asked for."""


class Nowhere:
    """The receiver of a connection that is none."""

    def connected(self) -> None:
        raise AssertionError("there is no connection")

    def received(self, data: bytes) -> None:
        raise AssertionError("there is no connection")

    def misused(self, reason: Reason) -> None:
        raise AssertionError("there is no connection")

    def doubtful(self) -> None:
        raise AssertionError("there is no connection")

    def over(self, problem: Problem | None) -> None:
        raise AssertionError("it never began")


@pytest.fixture
async def context() -> AsyncIterator[Context]:
    """One whose threads run already; it must end, as it does when no socket is left."""
    made: Context = zmq.Context()
    with made.socket(zmq.PAIR):  # closed only then: its descriptor would become free at any time
        yield made
    ending = threading.Thread(target=made.term, daemon=True)
    ending.start()
    await until_async("no socket is left", lambda: not ending.is_alive(), patience_s=10.0)


@pytest.mark.parametrize("kind", scarcity.KINDS)
def test_host_that_would_listen_without_descriptors_is_refused_and_ends(kind: str) -> None:
    command = [sys.executable, "-m", "tests.transport.peers.scarcity", kind, *map(str, LEFT)]
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    told = [line.split() for line in done.stdout.splitlines()]
    assert [int(left) for left, _ in told] == list(LEFT), done.stderr
    refused = [int(left) for left, code in told if code == "ADDRESS_UNUSABLE"]
    opened = [int(left) for left, code in told if code == scarcity.OPENED]
    assert sorted([*refused, *opened]) == list(LEFT)
    assert max(opened) == max(LEFT)


def test_descriptors_that_are_asked_for_are_given_back() -> None:
    before = open_descriptors()
    with descriptors_left(3):
        descriptors.see_that_there_are(3)
        with pytest.raises(OSError) as short:
            descriptors.see_that_there_are(4)
    assert short.value.errno == errno.EMFILE
    assert open_descriptors() == before


@pytest.mark.parametrize(
    ("number", "word"), [(errno.EMFILE, "LimitNOFILE"), (errno.ENFILE, "machine")]
)
def test_remedy_names_the_limit_that_was_met(number: int, word: str) -> None:
    assert word in descriptors.remedy(OSError(number, ""))
    assert word in descriptors.remedy(zmq.ZMQError(number))
    assert not descriptors.remedy(zmq.ZMQError(errno.EADDRINUSE))


async def test_handler_without_descriptors_leaves_nothing_open(context: Context) -> None:
    with descriptors_left(0), pytest.raises(zmq.ZMQError, match=os.strerror(errno.EMFILE)):
        ZapHandler(context, lambda _: Entry.TURNED_AWAY)


@pytest.mark.parametrize("left", range(2))
async def test_watch_without_descriptors_leaves_nothing_open(context: Context, left: int) -> None:
    with listening(context, KEYS) as socket:
        with descriptors_left(left), pytest.raises(zmq.ZMQError, match=os.strerror(errno.EMFILE)):
            Watch(socket, lambda _: None)
        Watch(socket, lambda _: None).close()


@pytest.mark.parametrize("left", range(4))
async def test_pairing_listener_without_descriptors_leaves_nothing_open(
    context: Context, left: int
) -> None:
    refusals = Refusals(lambda _: None)
    with descriptors_left(left), pytest.raises(zmq.ZMQError, match=os.strerror(errno.EMFILE)):
        PairingListener(context, KEYS, scarcity.ADDRESS, lambda *_: None, refusals)


@pytest.mark.parametrize("left", range(3))
async def test_pairing_listener_that_the_loop_does_not_watch_leaves_nothing_open(
    context: Context, left: int
) -> None:
    refusals = Refusals(lambda _: None)
    with watches_left(left), pytest.raises(OSError, match=os.strerror(errno.ENOSPC)):
        PairingListener(context, KEYS, scarcity.ADDRESS, lambda *_: None, refusals)


@pytest.mark.parametrize("left", range(2))
async def test_route_that_the_loop_does_not_watch_is_refused_and_leaves_nothing_open(
    context: Context, left: int
) -> None:
    other = HostKeys.generate().public
    with watches_left(left), pytest.raises(PeerRefused, match="DIAL_IMPOSSIBLE"):
        DialledRoute(lambda: dialling(context, KEYS, other), "tcp://127.0.0.1:9", Nowhere())


@pytest.mark.parametrize("left", range(3))
async def test_route_without_descriptors_is_refused_and_leaves_nothing_open(
    context: Context, left: int
) -> None:
    other = HostKeys.generate().public
    with descriptors_left(left), pytest.raises(PeerRefused, match="DIAL_IMPOSSIBLE") as refused:
        DialledRoute(lambda: dialling(context, KEYS, other), "tcp://127.0.0.1:9", Nowhere())
    assert "LimitNOFILE" in refused.value.problems[0].fix


async def test_route_to_what_is_no_address_is_refused_and_leaves_nothing_open(
    context: Context,
) -> None:
    other = HostKeys.generate().public
    with pytest.raises(PeerRefused, match="ADDRESS_MALFORMED"):
        DialledRoute(lambda: dialling(context, KEYS, other), "tcp://127.0.0.1", Nowhere())


async def test_dial_goes_on_once_there_are_descriptors_again() -> None:
    base, rover = identity("base"), identity("rover")
    async with host(base, trusting(rover)) as there, host(rover, trusting(base)) as here:
        with descriptors_left(0):
            here.node.dial(there.key, [there.address])
        assert (await here.told(DialFailed)).problem.code == "DIAL_IMPOSSIBLE"
        await up(here, there)


async def test_host_without_descriptors_goes_on_looking_at_its_connections(
    clock: VirtualClock,
) -> None:
    faults: list[dict[str, Any]] = []
    clock.set_exception_handler(lambda _, fault: faults.append(fault))
    async with host(identity("rover")):
        with descriptors_left(0):
            await clock.advance(3 * LOOK_S)
    assert not faults
