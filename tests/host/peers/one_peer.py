"""A peer in the test's process, that serves what the test has it serve."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any, cast

from nondum.host.peers.dispatch import Dispatcher
from nondum.sdk.wire import Body
from nondum.transport.peers import Admission, Call, IncomingCall, PeerKey
from nondum.transport.peers.messages import Request


class OnePeer:
    """Reaches one peer, which serves these calls."""

    def __init__(self, serves: dict[str, Any]) -> None:
        self.requests = Dispatcher()
        for method, serve in serves.items():
            self.requests.add(method, serve)

    def call(self, host: str, method: str, args: Body, *, deadline_s: float) -> Call:
        async def called() -> Body:
            answer = self.requests.serve(incoming(method, args))
            return answer if isinstance(answer, Mapping) else await answer

        return cast(Call, asyncio.ensure_future(called()))

    def notify(self, host: str, method: str, args: Body) -> None:
        raise AssertionError(f"{host} serves calls only, and got the notice {method}")


def incoming(method: str, args: Body) -> IncomingCall:
    admission = Admission(PeerKey("rover"), "rover", "pairing")
    return IncomingCall(admission, Request(1, 1, 60_000, method, args), lambda _, __: None)
