"""Asks hosts that the integrator has given who they are, again and again."""

from __future__ import annotations

import asyncio
import contextlib
import random
import secrets
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.transport.discovery import packets, udp
from nondum.transport.discovery.hint import Hint, Source, from_txt
from nondum.transport.discovery.resolver import resolve
from nondum.transport.discovery.static_host import StaticHost
from nondum.transport.discovery.status import StaticRow
from nondum.transport.peers.identity import Security, is_loopback
from nondum.transport.peers.keys import PeerKey

ANSWER_S = 0.5
"""How long one question waits for its answers."""
FIRST_WAIT_S = 0.25
LONGEST_WAIT_S = 5.0
"""Between two questions to a host that does not answer."""
SLOW_WAIT_S = 15.0
"""Between two questions to a host that has answered."""
PATIENCE = 3
"""Questions that a host which has answered may leave open, before it counts as gone."""


@dataclass(slots=True)
class _Asked:
    """One host, and what came of asking it."""

    host: StaticHost
    open: int = 0
    """Questions since it answered."""
    answered_s: float | None = None
    hints: dict[PeerKey, Hint] = field(default_factory=dict)
    problem: Problem | None = None
    nudged: asyncio.Event = field(default_factory=asyncio.Event)

    def wait_s(self) -> float:
        """How long to wait before the next question."""
        if self.hints and not self.open:
            return SLOW_WAIT_S
        return min(FIRST_WAIT_S * 2.0 ** min(self.open, 10), LONGEST_WAIT_S)


class Asker:
    """Asks from `start` to `close`."""

    def __init__(
        self,
        hosts: Sequence[StaticHost],
        security: Security,
        *,
        on_hint: Callable[[Hint], None],
        on_gone: Callable[[PeerKey], None],
        on_refused: Callable[[Problem], None],
    ) -> None:
        self._asked = tuple(_Asked(host) for host in dict.fromkeys(hosts))
        self._security = security
        self._on_hint, self._on_gone, self._on_refused = on_hint, on_gone, on_refused
        self._loop = asyncio.get_running_loop()
        self._tasks: list[asyncio.Task[None]] = []
        self._open: dict[bytes, tuple[str, asyncio.Queue[Hint]]] = {}
        self._transport: asyncio.DatagramTransport | None = None
        self._family = socket.AF_INET

    async def start(self) -> None:
        """Begin to ask. Raises `OSError` when no socket can be had."""
        if not self._asked:
            return
        loopback = self._security is Security.DEVELOPMENT
        sock = udp.bound("127.0.0.1" if loopback else udp.ANYWHERE, 0)
        self._family = sock.family
        self._transport, _ = await self._loop.create_datagram_endpoint(
            lambda: _Receiver(self._hear), sock=sock
        )
        self._tasks = [self._loop.create_task(self._keep_asking(one)) for one in self._asked]

    def hurry(self) -> None:
        """Ask at once: the network has changed."""
        for one in self._asked:
            one.nudged.set()

    @property
    def rows(self) -> tuple[StaticRow, ...]:
        """What came of it."""
        return tuple(
            StaticRow(
                host=str(one.host),
                asked=one.open,
                answered_s=one.answered_s,
                name=", ".join(hint.name for hint in one.hints.values()),
                problem=one.problem,
            )
            for one in self._asked
        )

    async def close(self) -> None:
        """Ask no more."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._transport is not None:
            self._transport.close()

    async def _keep_asking(self, asked: _Asked) -> None:
        while True:
            asked.nudged.clear()
            asked.open += 1
            try:
                ends = await self._ends(asked.host)
                found = await self._ask(asked, ends)
                asked.problem = None if found else _silent(asked.host)
            except OSError as error:
                found = {}
                asked.problem = _unknown(asked.host, error)
            self._settle(asked, found)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(asked.wait_s() * random.uniform(0.8, 1.2)):
                    await asked.nudged.wait()

    async def _ends(self, host: StaticHost) -> tuple[str, ...]:
        found = await resolve(host.host, host.port)
        if self._security is Security.CURVE:
            return found
        if near := tuple(one for one in found if is_loopback(one)):
            return near
        raise OSError("without keys, peers may be on this machine only")

    async def _ask(self, asked: _Asked, ends: Sequence[str]) -> dict[PeerKey, Hint]:
        """Ask at every address at once; who answered, until all have or it is too late."""
        answers: asyncio.Queue[Hint] = asyncio.Queue()
        nonces = {secrets.token_bytes(packets.NONCE): end for end in ends}
        self._open.update((nonce, (end, answers)) for nonce, end in nonces.items())
        found: dict[PeerKey, Hint] = {}
        try:
            for nonce, end in nonces.items():
                self._send(packets.question(nonce), end, asked.host.port)
            async with asyncio.timeout(ANSWER_S):
                while self._open.keys() & nonces.keys():
                    hint = await answers.get()
                    known = found.get(hint.key)
                    found[hint.key] = replace(
                        hint, addresses=(*(known.addresses if known else ()), *hint.addresses)
                    )
                    asked.open, asked.answered_s = 0, self._loop.time()
                    self._on_hint(found[hint.key])
        except TimeoutError:
            pass
        finally:
            for nonce in nonces:
                self._open.pop(nonce, None)
        return found

    def _send(self, data: bytes, end: str, port: int) -> None:
        assert self._transport is not None
        with contextlib.suppress(OSError):  # an address of a kind that this machine does not speak
            self._transport.sendto(data, udp.end(self._family, end, port))

    def _settle(self, asked: _Asked, found: dict[PeerKey, Hint]) -> None:
        """Forget who answers no more."""
        if not found and asked.open < PATIENCE:
            return
        for key in asked.hints.keys() - found.keys():
            self._on_gone(key)
        asked.hints = found

    def _hear(self, data: bytes) -> None:
        try:
            answer = packets.read_answer(data)
            if answer.nonce not in self._open:
                return  # late, or not an answer to a question of this host
            end, answers = self._open[answer.nonce]
            hint = from_txt(
                answer.txt, answer.port, [end], source=Source.STATIC, security=self._security
            )
        except ProtocolViolation as error:
            self._on_refused(error.problems[0])
            return
        del self._open[answer.nonce]
        answers.put_nowait(hint)


class _Receiver(asyncio.DatagramProtocol):
    def __init__(self, hear: Callable[[bytes], None]) -> None:
        self._hear = hear

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        self._hear(data)


def _silent(host: StaticHost) -> Problem:
    return Problem(
        "STATIC_SILENT",
        "no host answers there",
        where=str(host),
        fix=f"look whether nondum runs there, and whether UDP and TCP port {host.port} are open",
    )


def _unknown(host: StaticHost, error: OSError) -> Problem:
    return Problem(
        "STATIC_UNKNOWN",
        f"the host cannot be asked: {error.strerror or error}",
        where=str(host),
        fix="look at `peers.static`, or write the address instead of the name",
    )
