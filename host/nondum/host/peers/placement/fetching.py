"""Fetching files from a peer: by hash, in pieces, and never more than was listed."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

from nondum.host.lifecycle.lanes import in_thread
from nondum.host.peers.placement.handover import CHUNK
from nondum.sdk.errors import PayloadRefused, Problem
from nondum.transport.peers import Call

WINDOW = 8
"""Pieces that are asked for at once: enough to fill a link of some milliseconds."""


class Listed(NamedTuple):
    """A file as the contents list has it."""

    path: str
    sha256: str
    size: int


@dataclass(slots=True)
class Fetching:
    """Fetches files of one payload into one folder."""

    folder: Path
    read: Callable[[str, int], Call]
    """Asks for a piece of a file, by hash and offset."""
    on_bytes: Callable[[int], None] = lambda count: None
    """Told how many more there are now."""

    async def fetch(self, listed: Listed) -> None:
        """Have a file in the folder, whole and as listed.

        Raises `PayloadRefused` (HASH_MISMATCH), and what the call does.
        """
        path = self.folder / listed.path
        out = await in_thread(_created, path)
        pieces: deque[tuple[int, Call]] = deque()
        digest, asked = hashlib.sha256(), 0
        try:
            while asked < listed.size or pieces:
                while asked < listed.size and len(pieces) < WINDOW:
                    length = min(CHUNK, listed.size - asked)
                    pieces.append((length, self.read(listed.sha256, asked)))
                    asked += length
                length, call = pieces.popleft()
                data = (await call).get("data")
                if not isinstance(data, bytes) or len(data) != length:
                    raise PayloadRefused(_mismatch(listed, "is not as long as listed"))
                await in_thread(_add, out, digest, data)
                self.on_bytes(length)
        finally:
            for _, call in pieces:
                call.cancel()
            await in_thread(out.close)
        if digest.hexdigest() != listed.sha256:
            raise PayloadRefused(_mismatch(listed, "its bytes are not those that were listed"))


def _created(path: Path) -> BinaryIO:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path.open("xb")


def _add(out: BinaryIO, digest: hashlib._Hash, data: bytes) -> None:
    digest.update(data)
    out.write(data)


def _mismatch(listed: Listed, told: str) -> Problem:
    fix = "look at the drive in the other host"
    return Problem("HASH_MISMATCH", told, where=listed.path, need=listed.sha256[:16] + "…", fix=fix)
