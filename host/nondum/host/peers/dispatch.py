"""Dispatch of peers' calls: each is passed to the function that serves its method."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeAlias

from nondum.sdk.errors import Problem
from nondum.sdk.wire import Body
from nondum.transport.peers import Admission, CallFailed, IncomingCall, Lease, Loss

Serve: TypeAlias = Callable[[IncomingCall], Body | Awaitable[Body]]
Notice: TypeAlias = Callable[[str, Mapping[str, Any]], None]
"""The peer's name, and what it tells."""
Orphan: TypeAlias = Callable[[IncomingCall, Loss], Lease]


class Dispatcher:
    """Satisfies the links' `Handler`: methods by name."""

    def __init__(self) -> None:
        self._calls: dict[str, tuple[Serve, Orphan]] = {}
        self._notices: dict[str, Notice] = {}

    def add(self, method: str, serve: Serve, orphan: Orphan = lambda *_: Lease.STOP) -> None:
        """Have calls of a method carried out; `orphan` decides when their caller is lost."""
        self._calls[method] = serve, orphan

    def hear(self, method: str, notice: Notice) -> None:
        """Have news of a kind taken in."""
        self._notices[method] = notice

    def serve(self, incoming: IncomingCall) -> Body | Awaitable[Body]:
        """Carry a call out. Raises `CallFailed` (METHOD_UNKNOWN)."""
        known = self._calls.get(incoming.method)
        if known is None:
            told = f"this host does not know the call {incoming.method[:80]!r}"
            fix = "run the same version of nondum on both hosts"
            raise CallFailed(Problem("METHOD_UNKNOWN", told, fix=fix))
        return known[0](incoming)

    def notice(self, caller: Admission, method: str, args: dict[str, Any]) -> None:
        """Take news in; of a kind that is not known, none."""
        if known := self._notices.get(method):
            known(caller.name, args)

    def orphaned(self, incoming: IncomingCall, reason: Loss) -> Lease:
        """The caller of a running call is lost: what becomes of it."""
        known = self._calls.get(incoming.method)
        return known[1](incoming, reason) if known else Lease.STOP
