"""A peer without a host behind it: it asks for whatever a test wants."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

from nondum.sdk.wire import Body
from nondum.transport.fleet import FleetEvent, Mesh
from nondum.transport.peers import (
    Call,
    Handler,
    Identity,
    IncomingCall,
    Lease,
    Loss,
    PeerKey,
    PeerUp,
    Trust,
)

PATIENCE_S = 60.0
T = TypeVar("T")


class _Idle:
    """Does nothing for peers."""

    def serve(self, incoming: IncomingCall) -> Body:
        return {}

    def notice(self, *_: Any) -> None: ...

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        return Lease.STOP


class Guest:
    """A member of a mesh in development mode, on an event loop in its own thread."""

    def __init__(self, name: str, handler: Handler | None = None) -> None:
        """`handler` does what hosts ask of it; by default, nothing."""
        self.name, self._handler = name, handler or _Idle()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._peers: asyncio.Queue[PeerUp] = asyncio.Queue()
        self._mesh = self._run(self._begin())

    def meet(self, host: str, address: str) -> None:
        """Be a host's peer."""
        self._run(self._meet(host, address))

    def ask(self, host: str, method: str, **args: Any) -> dict[str, Any]:
        """Call a host, and wait for its answer. Raises `CallFailed`, `PeerUnreachable`."""

        async def ask() -> dict[str, Any]:
            return await self._call(host, method, args)

        return self._run(ask())

    def begin(self, host: str, **args: Any) -> Call:
        """Ask a host for a lasting behaviour, and wait until its effects hold."""

        async def begin() -> Call:
            call = self._call(host, "behave", args)
            async for report in call:
                if report["established"]:
                    return call
            raise AssertionError(await call)

        return self._run(begin())

    def reports(
        self, host: str, method: str, until: Mapping[str, Any], **args: Any
    ) -> list[dict[str, Any]]:
        """Call a host, and wait for a report that says so; all reports up to that one."""

        async def collect() -> list[dict[str, Any]]:
            call, found = self._call(host, method, args), []
            async for report in call:
                found.append(report)
                if until.items() <= report.items():
                    return found
            raise AssertionError(await call)

        return self._run(collect())

    def tell(self, host: str, method: str, args: Mapping[str, Any]) -> None:
        """Tell a host something."""

        async def tell() -> None:
            self._mesh.notify(_key(host), method, args)

        self._run(tell())

    def publish(self, entries: Mapping[str, Body | None]) -> None:
        """Offer something."""

        async def publish() -> None:
            self._mesh.publish(entries)

        self._run(publish())

    def leave(self) -> None:
        """Say goodbye."""
        self._run(self._mesh.close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(PATIENCE_S)
        self._loop.close()

    def _call(self, host: str, method: str, args: Mapping[str, Any]) -> Call:
        return self._mesh.call(_key(host), method, args, deadline_s=PATIENCE_S)

    async def _begin(self) -> Mesh:
        def on_event(event: FleetEvent) -> None:
            if isinstance(event, PeerUp):
                self._peers.put_nowait(event)

        mesh = Mesh(
            Identity(self.name, None),
            Trust(),
            self._handler,
            on_event=on_event,
            listen=("tcp://127.0.0.1:0",),
        )
        await mesh.start()
        return mesh

    async def _meet(self, host: str, address: str) -> None:
        self._mesh.meet(_key(host), [address])
        while (await self._peers.get()).name != host:
            pass

    def _run(self, work: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(PATIENCE_S)


@contextmanager
def guest(name: str, *hosts: tuple[str, str], handler: Handler | None = None) -> Iterator[Guest]:
    """A guest that has met some hosts, by name and address."""
    made = Guest(name, handler)
    try:
        for host, address in hosts:
            made.meet(host, address)
        yield made
    finally:
        made.leave()


def _key(host: str) -> PeerKey:
    return PeerKey(f"development:{host}")
