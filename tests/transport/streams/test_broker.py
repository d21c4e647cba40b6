"""The broker gives each end one half of a connection, or neither end keeps one."""

from __future__ import annotations

import os
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.link import Link
from nondum.sdk.packets import Handle
from nondum.transport import StreamBroker, Wire, WorkerLink, link_sockets

pytestmark = pytest.mark.anyio

WIRE = Wire("rover__cam__frames", "image", "cam", "eye")
OPTIONAL = Wire("rover__base__odometry", "pose", "base", "eye", "reader", "odometry")


class Party:
    """A worker that takes every half it is given, unless it is told to refuse."""

    def __init__(self, *, refuses: str = "") -> None:
        self.asked: list[tuple[str, dict[str, Any]]] = []
        self.halves: list[socket.socket] = []
        self._refuses = refuses

    async def serve(
        self, verb: str, body: dict[str, Any], handles: tuple[Handle, ...], _id: int
    ) -> dict[str, Any]:
        self.asked.append((verb, body))
        taken = [socket.socket(fileno=h) for h in handles if isinstance(h, int)]
        if verb == self._refuses:
            for half in taken:
                half.close()
            raise WorkerFailed(Problem("STREAM_UNKNOWN", "no such stream"))
        self.halves += taken
        return {}


@asynccontextmanager
async def linked(*parties: Party) -> AsyncIterator[list[WorkerLink]]:
    """A host's link to each party."""
    links: list[WorkerLink] = []
    ends: list[Link] = []
    for party in parties:
        ours, theirs = link_sockets()
        ends.append(
            Link(theirs, party.serve, lambda *_: None, lambda: None, lambda _: None, max_handles=1)
        )
        links.append(
            WorkerLink(
                ours, on_event=lambda *_: None, on_closed=lambda: None, on_violation=lambda _: None
            )
        )
    yield links
    for link in links:
        link.close()
    for end in ends:
        end.close()
    for half in (half for party in parties for half in party.halves):
        half.close()


def open_sockets() -> int:
    paths = (f"/proc/self/fd/{name}" for name in os.listdir("/proc/self/fd"))  # noqa: PTH208  # names, not paths
    return sum(os.path.exists(p) and os.readlink(p).startswith("socket") for p in paths)  # noqa: PTH110, PTH115  # sockets are no real paths


async def test_halves_are_connected_and_the_host_keeps_none() -> None:
    camera, eye = Party(), Party()
    async with linked(camera, eye) as (camera_link, eye_link):
        before = open_sockets()
        await StreamBroker().connect(WIRE, camera_link, eye_link)
        assert open_sockets() == before + 2
        camera.halves[0].send(b"frame")
        assert eye.halves[0].recv(16) == b"frame"
    assert camera.asked == [
        ("produce", {"stream": WIRE.stream, "type": "image", "consumer": "eye"})
    ]
    assert eye.asked == [("consume", {"stream": WIRE.stream, "type": "image"})]


async def test_each_half_is_known_by_who_sends_to_it_as_long_as_it_is_connected() -> None:
    camera, eye = Party(), Party()
    async with linked(camera, eye) as (camera_link, eye_link):
        broker = StreamBroker()
        await broker.connect(WIRE, camera_link, eye_link)
        (of_camera,), (of_eye,) = camera.halves, eye.halves
        inodes = [os.fstat(half.fileno()).st_ino for half in (of_camera, of_eye)]
        assert broker.senders == dict(zip(inodes, ("eye", "cam"), strict=True))
        await broker.disconnect(WIRE, camera_link, eye_link)
        assert broker.senders == {}


async def test_optional_input_is_named() -> None:
    base, eye = Party(), Party()
    async with linked(base, eye) as (base_link, eye_link):
        await StreamBroker().connect(OPTIONAL, base_link, eye_link)
    assert base.asked[0][1]["consumer"] == "eye.reader.odometry"
    assert eye.asked[0][1]["slot"] == "odometry"
    assert eye.asked[0][1]["unit"] == "reader"


@pytest.mark.parametrize("refuses", ["produce", "consume"])
async def test_refusal_leaves_neither_end_connected(refuses: str) -> None:
    camera, eye = Party(refuses=refuses), Party(refuses=refuses)
    async with linked(camera, eye) as (camera_link, eye_link):
        before = open_sockets()
        with pytest.raises(WorkerFailed, match="STREAM_UNKNOWN"):
            await StreamBroker().connect(WIRE, camera_link, eye_link)
        assert open_sockets() <= before + 1
    assert camera.asked[-1] == ("unproduce", {"stream": WIRE.stream, "consumer": "eye"})
    assert eye.asked[-1] == ("unconsume", {"stream": WIRE.stream, "type": "image"})


async def test_disconnecting_what_is_gone_is_harmless() -> None:
    camera, eye = Party(), Party()
    async with linked(camera, eye) as (camera_link, eye_link):
        eye_link.close()
        await StreamBroker().disconnect(WIRE, camera_link, eye_link)
        await StreamBroker().disconnect(WIRE, None, None)
    assert [verb for verb, _ in camera.asked] == ["unproduce"]
