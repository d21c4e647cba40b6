"""A host of the version before, as far as it was recorded: it says again what it said."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import TracebackType
from typing import Self

import zmq
from tests.kit import version_before
from tests.kit.until import PATIENCE_S

from nondum.transport.peers.messages import (
    Hello,
    Notice,
    Progress,
    Reply,
    Request,
    decode,
    encode,
)

READ = "fleet.read"
"""The call by which a host reads a peer's catalogue."""


class FormerPeer:
    """It dials a host that needs no keys. Use it as a context."""

    def __init__(self, address: str) -> None:
        self._said = [(decode(data), data) for data in version_before.said("before")]
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._dealer = self._context.socket(zmq.DEALER)
        self._dealer.rcvtimeo = round(PATIENCE_S * 1000)
        self._dealer.connect(address)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._context.destroy(linger=0)

    def greet(self) -> None:
        """Say hello, and tell the catalogue when it is asked for it."""
        self._dealer.send(next(data for one, data in self._said if isinstance(one, Hello)))
        asked = self._until_asked()
        for message in self._answers():
            self._dealer.send(encode(replace(message, number=asked.number)))

    def tell(self) -> None:
        """Tell each change of the catalogue, byte for byte."""
        for message, data in self._said:
            if isinstance(message, Notice):
                self._dealer.send(data)

    def _until_asked(self) -> Request:
        while True:
            message = decode(self._dealer.recv())
            if isinstance(message, Request) and message.method == READ:
                return message

    def _answers(self) -> Iterator[Progress | Reply]:
        """What it answered the first call."""
        answers = (one for one, _ in self._said if isinstance(one, Progress | Reply))
        number = None
        for answer in answers:
            number = number or answer.number
            if answer.number == number:
                yield answer
