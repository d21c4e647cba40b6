"""Calls over ZeroMQ by its asyncio sockets: a DEALER that asks, a ROUTER that answers."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from typing import Any

import msgpack
import zmq.asyncio


async def answer(router: zmq.asyncio.Socket, reply: Mapping[str, str]) -> None:
    """Answer every request alike, until cancelled."""
    while True:
        peer, data = await router.recv_multipart()
        call_id, _verb, _body = msgpack.unpackb(data)
        await router.send_multipart([peer, msgpack.packb([call_id, reply])])


@contextlib.asynccontextmanager
async def asking(
    dealer: zmq.asyncio.Socket, request: Mapping[str, str]
) -> AsyncIterator[Callable[[], Awaitable[Any]]]:
    """What makes one call; answers are matched to callers by id."""
    ids, waiting = itertools.count(1), dict[int, asyncio.Future[Any]]()

    async def receive() -> None:
        while True:
            call_id, body = msgpack.unpackb(await dealer.recv())
            waiting.pop(call_id).set_result(body)

    async def call() -> Any:
        call_id = next(ids)
        reply = waiting[call_id] = asyncio.get_running_loop().create_future()
        await dealer.send(msgpack.packb([call_id, "call", request]))
        return await reply

    receiving = asyncio.create_task(receive())
    try:
        yield call
    finally:
        receiving.cancel()
