"""Answers "who is there?" by UDP, at the port number that peers dial by TCP."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from nondum.sdk.errors import Problem
from nondum.transport.discovery import packets, udp
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.link.token_bucket import TokenBucket

ANSWERS_PER_S = 100.0
BURST = 200.0


class Responder:
    """Answers until it is closed. Questions beyond the rate are not answered."""

    def __init__(self, announcement: Announcement) -> None:
        self.announcement = announcement
        self.problem: Problem | None = None
        """Why it does not answer."""
        self._loop = asyncio.get_running_loop()
        self._rate = TokenBucket(ANSWERS_PER_S, BURST, self._loop.time())
        self._transports: list[asyncio.DatagramTransport] = []

    async def start(self) -> None:
        """Listen where peers are listened for; when that fails, `problem` tells why."""
        if self._transports:
            return
        here = self.announcement
        hosts = (udp.ANYWHERE,) if here.is_everywhere else here.hosts
        self.problem = None
        try:
            for host in hosts:
                transport, _ = await self._loop.create_datagram_endpoint(
                    lambda: _Receiver(self._answer), sock=udp.bound(host, here.port)
                )
                self._transports.append(transport)
        except OSError as error:
            self.close()
            self.problem = Problem(
                "ASKING_UNUSABLE",
                f"hosts that ask by UDP cannot be answered: {error.strerror or error}",
                where=f"UDP port {here.port}",
                fix="end the program that has the port, or set another one in `peers.listen`",
            )

    def close(self) -> None:
        """Answer no more."""
        for transport in self._transports:
            transport.close()
        self._transports.clear()

    def _answer(self, data: bytes) -> bytes | None:
        nonce = packets.nonce_of(data)
        if nonce is None or not self._rate.take(1, self._loop.time()):
            return None
        return packets.answer(nonce, self.announcement)


class _Receiver(asyncio.DatagramProtocol):
    """One socket."""

    def __init__(self, answer: Callable[[bytes], bytes | None]) -> None:
        self._answer = answer
        self._transport: asyncio.DatagramTransport | None = None

    def connection_made(self, transport: asyncio.DatagramTransport) -> None:  # type: ignore[override] # asyncio types it too wide
        self._transport = transport

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        if self._transport is not None and (answer := self._answer(data)) is not None:
            self._transport.sendto(answer, addr)
