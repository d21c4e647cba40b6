"""A payload that a peer wants to run here, and how far it is."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nondum.host.core.printable import printable
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen
from nondum.transport.peers import CallFailed, IncomingCall
from nondum.wheelhouse.format import contents, names
from nondum.wheelhouse.format.signatures import MAX_SIGNATURE_BYTES

PROGRESS_S = 0.2
"""Time between two reports of what was fetched."""

_DIGEST = re.compile(r"[0-9a-f]{64}")


@frozen
class Offer:
    """A payload that a peer wants to run here."""

    digest: str
    payload_id: str
    contents: int
    signature: bytes | None
    why: str

    @classmethod
    def parse(cls, args: Mapping[str, Any]) -> Offer:
        """Read the arguments of `place.take`. Raises `CallFailed` (CALL_MALFORMED)."""
        match args:
            case {
                "digest": str(digest),
                "payload": str(payload_id),
                "contents": int(size),
                "signature": bytes() | None as signature,
                "why": str(why),
            } if (
                _DIGEST.fullmatch(digest)
                and names.PAYLOAD_ID.fullmatch(payload_id)
                and 0 < size <= contents.MAX_BYTES
                and len(signature or b"") <= MAX_SIGNATURE_BYTES
            ):
                return cls(digest, payload_id, size, signature, printable(why[:500]))
        told = "a call's arguments are not what it takes"
        need = "digest, payload, contents, signature and why"
        raise CallFailed(Problem("CALL_MALFORMED", told, need=need))


@dataclass(slots=True, eq=False)
class Guest:
    """A payload of a peer."""

    offer: Offer
    incoming: IncomingCall
    drive: str
    """Name of the drive that stands for it."""
    root: Path
    key: str
    """Of the payload on this host."""
    step: str = "waiting"
    """`waiting`, `checking`, `fetching`, `installing` or `active`."""
    done: int = 0
    total: int = 0
    version: str = ""
    news: asyncio.Event = field(default_factory=asyncio.Event)
    _told_s: float = 0.0

    @property
    def folder(self) -> Path:
        """Where the payload lies."""
        return self.root / "nondum" / self.offer.payload_id

    def tell(self, step: str) -> None:
        """Report how far it is."""
        self.step = step
        self._told_s = _now_s()
        self.incoming.progress({"step": step, "done": self.done, "total": self.total})

    def add(self, count: int) -> None:
        """More bytes are here."""
        self.done += count
        if self.done >= self.total or _now_s() - self._told_s >= PROGRESS_S:
            self.tell("fetching")


def _now_s() -> float:
    return asyncio.get_running_loop().time()
