"""The daemon's end of this host's bridge: a child that carries streams to and from other hosts.

It is forked for the first stream and ended some time after the last. Its keys are its own, made
at every start; the host's secret stays with the daemon.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import secrets
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from typing import Any

from nondum.host.forking.fork_client import ForkClient, Forked
from nondum.sdk.errors import LinkClosed, NondumError, Problem, ProtocolViolation, WorkerFailed
from nondum.sdk.frozen import frozen
from nondum.sdk.wire_fields import read_problem
from nondum.transport import WorkerLink
from nondum.transport.peers.keys import PeerKey

IDLE_S = 10.0
"""How long a bridge without streams is kept."""
FORK_S = 60.0
"""How long the fork server may take, which may have to be started first."""
START_S = 20.0
"""How long the child may take from then on."""
GRACE_S = 1.0
NAME = "bridge"
"""What the fork server knows it by (`jobs/table.py`)."""
OnOver = Callable[[Problem], None]


@frozen
class Grant:
    """What the reader of an exported stream must know to claim it."""

    port: int
    """Where the owner's bridge listens, on the addresses of its host."""
    key: PeerKey
    """The owner's bridge."""
    token: str


@frozen
class _Export:
    reader: PeerKey
    on_over: OnOver


@frozen
class _Running:
    process: Forked
    link: WorkerLink
    port: int
    key: PeerKey


class Bridge:
    """Has the child forked when it is needed. Use it on the loop; `await close()` it."""

    def __init__(
        self, forks: ForkClient, listen: Sequence[str], *, port: int = 0, idle_s: float = IDLE_S
    ) -> None:
        """Listen on the interfaces of some addresses, `tcp://INTERFACE:PORT`, but at `port`.

        Port 0 has the system pick one. `forks` stays the caller's to close.
        """
        self._forks = forks
        self._port = port
        self._interfaces = tuple(dict.fromkeys(interface(address) for address in listen))
        self._idle_s = idle_s
        self._running: _Running | None = None
        self._lock = asyncio.Lock()
        self._exports: dict[str, _Export] = {}
        self._imports: dict[int, OnOver] = {}
        self._numbers = itertools.count(1)
        self._users = 0
        """Calls under way."""
        self._ending: asyncio.TimerHandle | None = None
        self._endings: set[asyncio.Task[None]] = set()
        self._is_closed = False

    @property
    def pid(self) -> int | None:
        """Process id of the child, while there is one."""
        return self._running.process.pid if self._running else None

    async def expect(self) -> None:
        """Prepare for streams: the first one then waits for a fork only."""
        await self._forks.expect(NAME)

    @contextlib.asynccontextmanager
    async def kept(self) -> AsyncIterator[PeerKey]:
        """Have the bridge run, under one key, for as long as the context lasts; the key.

        Raises `WorkerFailed` (BRIDGE_START).
        """
        async with self._use() as running:
            yield running.key

    async def export(
        self, kind: str, connection: socket.socket, reader: PeerKey, on_over: OnOver
    ) -> Grant:
        """Let another host's bridge, by its key, read a stream of type `kind`.

        `connection` is a consumer's end of the stream, and stays the caller's to close. `on_over`
        is called once when the stream or the reader is gone, not after `unexport` or `withdraw`.
        Raises `WorkerFailed`, `LinkClosed`.
        """
        token = secrets.token_hex(16)
        body = {"token": token, "type": kind, "reader": reader}
        async with self._use() as running:
            self._exports[token] = _Export(reader, on_over)
            try:
                await running.link.request("export", body, (connection.fileno(),))
            except BaseException:
                self._exports.pop(token, None)
                raise
            return Grant(running.port, running.key, token)

    async def unexport(self, token: str) -> None:
        """End one export; unknown ones are ignored."""
        if self._exports.pop(token, None) is not None:
            await self._ask("unexport", {"token": token})

    async def withdraw(self, reader: PeerKey) -> None:
        """End all that a bridge reads, and let it in no more."""
        for token in [token for token, one in self._exports.items() if one.reader == reader]:
            await self.unexport(token)

    async def import_(
        self, kind: str, addresses: Sequence[str], grant: Grant, on_over: OnOver
    ) -> int:
        """Read a stream of type `kind` that another host has granted; the number of the import.

        `addresses` are those of the host (`tcp://HOST:PORT`); the port is the grant's. `on_over`
        is called once when it has ended, not after `unimport`. Raises `WorkerFailed` with the
        answer of the other bridge, or if it does not answer; `LinkClosed`.
        """
        number = next(self._numbers)
        body = {
            "import": number,
            "type": kind,
            "addresses": [with_port(address, grant.port) for address in addresses],
            "owner": grant.key,
            "token": grant.token,
        }
        async with self._use() as running:
            self._imports[number] = on_over
            try:
                await running.link.request("import", body)
            except BaseException:
                self._imports.pop(number, None)
                raise
        return number

    async def unimport(self, number: int) -> None:
        """End an import, and with it the stream for all its readers; unknown ones are ignored."""
        if self._imports.pop(number, None) is not None:
            await self._ask("unimport", {"import": number})

    async def feed(self, number: int, consumer: str, connection: socket.socket) -> None:
        """Give an import one more consumer; `connection` stays the caller's to close.

        Raises `WorkerFailed` (STREAM_UNKNOWN), `LinkClosed`.
        """
        body = {"import": number, "consumer": consumer}
        async with self._use() as running:
            await running.link.request("feed", body, (connection.fileno(),))

    async def unfeed(self, number: int, consumer: str) -> None:
        """Take a consumer back; unknown ones are ignored."""
        await self._ask("unfeed", {"import": number, "consumer": consumer})

    async def figures(self) -> dict[str, Any]:
        """What crosses now: `exports` by token, `imports` by number; nothing without a child."""
        return await self._ask("figures", {}) or {"exports": {}, "imports": {}}

    async def close(self) -> None:
        """End the child."""
        self._is_closed = True
        if self._ending is not None:
            self._ending.cancel()
        async with self._lock:
            self._end()
        await asyncio.gather(*self._endings)

    @contextlib.asynccontextmanager
    async def _use(self) -> AsyncIterator[_Running]:
        """The child, started if there is none, and not ended meanwhile."""
        self._users += 1
        self._rest()
        try:
            async with self._lock:
                if self._running is None:
                    self._running = await self._start()
                running = self._running
            yield running
        finally:
            self._users -= 1
            self._rest()

    async def _ask(self, verb: str, body: dict[str, Any]) -> dict[str, Any]:
        """Ask the child if there is one: without it, there is nothing to undo."""
        if self._running is None:
            return {}
        try:
            return await self._running.link.request(verb, body)
        except (WorkerFailed, LinkClosed):
            return {}
        finally:
            self._rest()

    async def _start(self) -> _Running:
        if self._is_closed:
            raise LinkClosed(Problem("LINK_CLOSED", "the bridge is closed"))
        body = {"interfaces": list(self._interfaces), "port": self._port}
        try:
            process = await self._forks.fork(NAME, FORK_S)
        except (OSError, EOFError) as error:  # a TimeoutError is an OSError
            raise _not_started(str(error) or f"no process for {FORK_S:g} s") from error
        link = WorkerLink(
            process.conversation,
            on_event=self._on_event,
            on_closed=lambda: self._on_closed(link),
            on_violation=lambda _: None,
        )
        try:
            async with asyncio.timeout(START_S):
                await link.meet({})
                answer = await link.request("listen", body)
        except (NondumError, TimeoutError) as error:
            await _ended(link, process, 0)
            raise _not_started(str(error) or f"no answer for {START_S:g} s") from error
        except BaseException:
            link.close()
            _killed(process)
            raise
        return _Running(process, link, answer["port"], PeerKey(answer["key"]))

    def _rest(self) -> None:
        """End the child in a while if nothing crosses."""
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None
        is_idle = not self._users and not self._exports and not self._imports
        if is_idle and self._running is not None and not self._is_closed:
            self._ending = asyncio.get_running_loop().call_later(self._idle_s, self._end)

    def _end(self) -> None:
        """End the child; the next call that needs one starts another."""
        running, self._running = self._running, None
        if running is not None:
            ending = _ended(running.link, running.process, GRACE_S)
            task = asyncio.get_running_loop().create_task(ending)
            self._endings.add(task)
            task.add_done_callback(self._endings.discard)

    def _on_event(self, name: str, body: dict[str, Any], _call_id: int | None) -> None:
        match name, body:
            case "export_over", {"token": str(token), "problem": problem}:
                export = self._exports.pop(token, None)
                self._over(export.on_over if export else None, read_problem(problem))
            case "import_over", {"import": int(number), "problem": problem}:
                self._over(self._imports.pop(number, None), read_problem(problem))
            case _:
                raise ProtocolViolation(Problem("EVENT_UNKNOWN", f"a bridge tells no {name!r}"))

    def _over(self, on_over: OnOver | None, problem: Problem) -> None:
        if on_over is not None:
            on_over(problem)
        self._rest()

    def _on_closed(self, link: WorkerLink) -> None:
        """The child has died, or is not what it should be: all that crossed is over."""
        running = self._running
        if running is None or running.link is not link:
            return
        self._running = None
        _killed(running.process)
        ended = [*(one.on_over for one in self._exports.values()), *self._imports.values()]
        self._exports.clear()
        self._imports.clear()
        for on_over in ended:
            on_over(Problem("BRIDGE_DIED", "the bridge to other hosts has ended"))


async def _ended(link: WorkerLink, process: Forked, grace_s: float) -> None:
    link.close()
    if not await _is_over(process, grace_s):
        process.kill()
        await _is_over(process, GRACE_S)
    process.close()


async def _is_over(process: Forked, timeout_s: float) -> bool:
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(process.over(), timeout_s)
    return process.is_over


def _killed(process: Forked) -> None:
    process.kill()
    process.close()


def _not_started(why: str) -> WorkerFailed:
    told = f"the bridge to other hosts does not start: {why}"
    return WorkerFailed(Problem("BRIDGE_START", told))


def interface(address: str) -> str:
    """What an address listens on.

    >>> interface("tcp://*:7410"), interface("tcp://[::1]:0")
    ('*', '[::1]')
    """
    return address.removeprefix("tcp://").rpartition(":")[0]


def with_port(address: str, port: int) -> str:
    """The same host at another port.

    >>> with_port("tcp://10.0.0.7:7410", 40001)
    'tcp://10.0.0.7:40001'
    """
    return f"tcp://{interface(address)}:{port}"
