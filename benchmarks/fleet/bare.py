"""A host of bare ZeroMQ: what sockets, CURVE and msgpack take by themselves where all are linked.

It lacks what a mesh adds: who may come in, versions, signs of life, deaths, what was missed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from typing import Any

import msgpack
import zmq
from benchmarks.fleet.told import CATALOGUE, NEWS, tell, usage


class BareHost:
    """Listens at one socket and dials with one more for each host whose key is greater."""

    def __init__(self, config: dict[str, Any]) -> None:
        self._config = config
        self._context = zmq.Context()
        self._listener = self._socket(zmq.ROUTER)
        self._listener.curve_server = True
        self.address = f"tcp://127.0.0.1:{self._listener.bind_to_random_port('tcp://127.0.0.1')}"
        self._dialled: list[zmq.Socket[bytes]] = []
        self._came: list[bytes] = []
        self._poller = zmq.Poller()
        self._poller.register(self._listener, zmq.POLLIN)
        self._poller.register(0, zmq.POLLIN)
        self._unread = b""
        """The begin of a line of which the rest has not come."""
        self._complete: set[bytes] = set()
        self._expected = len(config["trusted"]) - 1
        self._news = 0
        self._waiting: Callable[[], bool] | None = None

    def run(self) -> None:
        """Do as told, line by line, until the lines end."""
        while True:
            found = dict(self._poller.poll())
            for socket in (self._listener, *self._dialled):
                if socket in found:
                    self._take_in(socket)
            if 0 in found:
                said = os.read(0, 1 << 20)
                if not said:
                    return
                for line in self._lines(said):
                    self._do(json.loads(line))
            if self._waiting is not None and self._waiting():
                self._waiting = None
                tell(usage() | {"lost": []})

    def _socket(self, kind: int) -> zmq.Socket[bytes]:
        socket: zmq.Socket[bytes] = self._context.socket(kind)
        socket.linger = 0
        socket.curve_publickey = self._config["public"].encode()
        socket.curve_secretkey = self._config["secret"].encode()
        return socket

    def _lines(self, said: bytes) -> Iterator[bytes]:
        *lines, self._unread = (self._unread + said).split(b"\n")
        yield from lines

    def _do(self, order: dict[str, Any]) -> None:
        match order["do"]:
            case "meet":
                for key, address in order["places"].items():
                    if key > self._config["public"]:
                        self._dial(key, address)
                self._waiting = lambda: len(self._complete) == self._expected
            case "look":
                tell(usage() | {"lost": []})
            case "publish":
                news = self._packed(NEWS)
                for socket in self._dialled:
                    socket.send(news)
                for name in self._came:
                    self._listener.send_multipart([name, news])
            case "hear":
                self._waiting = lambda: self._news > 0

    def _dial(self, key: str, address: str) -> None:
        socket = self._socket(zmq.DEALER)
        socket.curve_serverkey = key.encode()
        socket.connect(address)
        self._poller.register(socket, zmq.POLLIN)
        self._dialled.append(socket)
        socket.send(self._packed(CATALOGUE))

    def _take_in(self, socket: zmq.Socket[bytes]) -> None:
        while int(socket.getsockopt(zmq.EVENTS)) & zmq.POLLIN:
            *name, data = socket.recv_multipart()
            key, entries = msgpack.unpackb(data)
            if entries == NEWS:
                self._news += 1
                continue
            self._complete.add(key)
            if name:
                self._came += name
                socket.send_multipart([*name, self._packed(CATALOGUE)])

    def _packed(self, entries: dict[str, Any]) -> bytes:
        packed: bytes = msgpack.packb([self._config["public"], entries])
        return packed


def be_bare(config: dict[str, Any]) -> None:
    """One host."""
    host = BareHost(config)
    tell({"addresses": [host.address]})
    host.run()
