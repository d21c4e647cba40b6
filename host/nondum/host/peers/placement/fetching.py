"""Fetching files from a peer: by hash, in pieces, and never more than was listed."""

from __future__ import annotations

import asyncio
import hashlib
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

from nondum.host.core.keyed_queues import in_thread
from nondum.host.peers.placement.pace import Pace
from nondum.sdk.errors import PayloadRefused, Problem
from nondum.transport.peers import Call


class Listed(NamedTuple):
    """A file as the contents list has it."""

    path: str
    sha256: str
    size: int


@dataclass(slots=True)
class Fetching:
    """Fetches files of one payload into one folder."""

    folder: Path
    read: Callable[[str, int, int], Call]
    """Asks for a piece of a file, by hash, offset and length."""
    on_bytes: Callable[[int], None] = lambda count: None
    """Told how many more there are now."""
    pace: Pace = field(default_factory=Pace)

    async def fetch(self, listed: Listed) -> None:
        """Have a file in the folder, whole and as listed.

        Raises `PayloadRefused` (HASH_MISMATCH), and what the call does.
        """
        path = self.folder / listed.path
        pieces: deque[_Piece] = deque()
        digest, done = hashlib.sha256(), 0
        opened = ExitStack()
        try:
            out = await in_thread(_created, path, opened)
            while done < listed.size:
                self._ask(listed, done, pieces)
                piece = pieces.popleft()
                data = (await piece.call).get("data")
                if not isinstance(data, bytes) or len(data) != piece.length:
                    raise PayloadRefused(_mismatch(listed, "is not as long as listed"))
                self.pace.answered(piece.length, _now_s() - piece.asked_s)
                await in_thread(_add, out, digest, data)
                done += piece.length
                self.on_bytes(piece.length)
        finally:
            for piece in pieces:
                piece.call.cancel()
            await in_thread(opened.close)
        if digest.hexdigest() != listed.sha256:
            raise PayloadRefused(_mismatch(listed, "its bytes are not those that were listed"))

    def _ask(self, listed: Listed, done: int, pieces: deque[_Piece]) -> None:
        """Ask for as much as may be on its way; for one piece in any case."""
        asked = done + sum(piece.length for piece in pieces)
        while asked < listed.size and (not pieces or asked - done < self.pace.window):
            length = min(self.pace.piece, listed.size - asked)
            pieces.append(_Piece(length, self.read(listed.sha256, asked, length), _now_s()))
            asked += length


class _Piece(NamedTuple):
    """What was asked for."""

    length: int
    call: Call
    asked_s: float


def _now_s() -> float:
    return asyncio.get_running_loop().time()


def _created(path: Path, opened: ExitStack) -> BinaryIO:
    path.parent.mkdir(parents=True, exist_ok=True)
    return opened.enter_context(path.open("xb"))


def _add(out: BinaryIO, digest: hashlib._Hash, data: bytes) -> None:
    digest.update(data)
    out.write(data)


def _mismatch(listed: Listed, told: str) -> Problem:
    fix = "look at the drive in the other host"
    return Problem("HASH_MISMATCH", told, where=listed.path, need=listed.sha256[:16] + "…", fix=fix)
