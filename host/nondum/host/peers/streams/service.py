"""The bridge's process: carries out what the daemon asks over its link, and says what ended."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Callable, Mapping
from typing import Any

import zmq

from nondum.host.peers.streams.inbound import Inbound
from nondum.host.peers.streams.outbound import Outbound
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.link import Link
from nondum.sdk.packets import Handle, adopt, discard
from nondum.sdk.plugin import version_of
from nondum.sdk.wire import MAX_PACKET, PROTOCOL_VERSIONS, Hello
from nondum.transport.peers.keys import HostKeys, PeerKey
from nondum.transport.streams import Exporter, Place

log = logging.getLogger(__name__)

Answer = dict[str, Any]


class Service:
    """One bridge's life."""

    def __init__(self, sock: socket.socket) -> None:
        """Own `sock`, the link to the daemon."""
        self._over = asyncio.Event()
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._keys = HostKeys.generate()
        self._exporter = Exporter(self._context, self._keys)
        self._exports: dict[str, Outbound] = {}
        self._imports: dict[int, Inbound] = {}
        self._verbs: Mapping[str, Callable[[Answer], Answer]] = {
            "unexport": self._unexport,
            "unfeed": self._unfeed,
            "unimport": self._unimport,
            "figures": self._figures,
        }
        self._link = Link(
            sock,
            self._on_request,
            lambda *_: None,
            self._over.set,
            lambda violation: log.error("the daemon broke the protocol: %s", violation),
            max_handles=1,
        )

    async def run(self) -> None:
        """Serve until the daemon closes the link."""
        await self._link.greet(Hello(PROTOCOL_VERSIONS, version_of("nondum-sdk"), os.getpid()))
        await self._over.wait()
        for inbound in self._imports.values():
            inbound.close()
        for outbound in self._exports.values():
            outbound.end(Problem("STREAM_ENDED", "the host ends its bridge"))
        self._exporter.close()

    async def _on_request(
        self, verb: str, body: Answer, handles: tuple[Handle, ...], _id: int
    ) -> Answer:
        match verb, handles:
            case "listen", ():
                port = await self._exporter.start(body["interfaces"], body["port"])
                return {"port": port, "key": self._keys.public}
            case "import", ():
                return await self._import(body)
            case "export", (handle,):
                return self._export(body, handle)
            case "feed", (handle,):
                return self._feed(body, handle)
            case str(), () if verb in self._verbs:
                return self._verbs[verb](body)
        discard(handles)
        raise WorkerFailed(Problem("VERB_UNKNOWN", f"a bridge has no verb {verb!r}"))

    def _export(self, body: Answer, handle: Handle) -> Answer:
        token = body["token"]

        def on_over(problem: Problem) -> None:
            if self._exports.pop(token, None) is not None:
                fields = {"token": token, "problem": problem.to_dict()}
                self._link.send_event("export_over", fields)

        packets, reader = adopt(handle, MAX_PACKET), PeerKey(body["reader"])
        self._exports[token] = Outbound(
            self._exporter, token, reader, body["type"], packets, on_over
        )
        return {}

    def _unexport(self, body: Answer) -> Answer:
        if outbound := self._exports.pop(body["token"], None):
            outbound.end(_CLOSED)
        return {}

    async def _import(self, body: Answer) -> Answer:
        number = body["import"]

        def on_over(problem: Problem) -> None:
            if self._imports.get(number) is inbound:
                del self._imports[number]
                fields = {"import": number, "problem": problem.to_dict()}
                self._link.send_event("import_over", fields)

        place = Place(tuple(body["addresses"]), PeerKey(body["owner"]), body["token"])
        inbound = Inbound(self._context, self._keys, place, body["type"], on_over)
        self._imports[number] = inbound
        try:
            await inbound.opened
        except BaseException:
            if self._imports.get(number) is inbound:
                del self._imports[number]
            inbound.close()
            raise
        return {}

    def _feed(self, body: Answer, handle: Handle) -> Answer:
        inbound = self._imports.get(body["import"])
        if inbound is None:
            discard((handle,))
            raise WorkerFailed(Problem("STREAM_UNKNOWN", "the stream is not imported"))
        inbound.producer.connect(body["consumer"], adopt(handle, MAX_PACKET))
        return {}

    def _unfeed(self, body: Answer) -> Answer:
        if inbound := self._imports.get(body["import"]):
            inbound.producer.disconnect(body["consumer"])
        return {}

    def _unimport(self, body: Answer) -> Answer:
        if inbound := self._imports.pop(body["import"], None):
            inbound.close()
        return {}

    def _figures(self, _body: Answer) -> Answer:
        return {
            "exports": {token: one.figures() for token, one in self._exports.items()},
            "imports": {str(number): one.figures() for number, one in self._imports.items()},
        }


_CLOSED = Problem("STREAM_ENDED", "the host does not send it any more")
