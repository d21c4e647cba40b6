"""Files come by hash and in pieces, whole and as listed, or not at all."""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nondum.host.peers.placement.fetching import Fetching, Listed
from nondum.host.peers.placement.pace import LARGEST, LEAST, MOST, PIECES
from nondum.sdk.errors import NondumError, Problem
from nondum.transport.peers import Call, CallFailed
from nondum.transport.peers.messages import Request

pytestmark = pytest.mark.anyio


class Owner:
    """Answers each call after the loop has gone round a few times, as it likes."""

    def __init__(self, data: bytes, answer: Callable[[int, bytes], Any] | None = None) -> None:
        self._data, self._answer = data, answer or (lambda offset, piece: piece)
        self.running: dict[int, int] = {}
        """Offset → length of what is asked for and not answered."""
        self.most = 0

    def read(self, sha256: str, offset: int, length: int) -> Call:
        call = asked(offset)
        self.running[offset] = length
        self.most = max(self.most, sum(self.running.values()))
        asyncio.get_running_loop().call_soon(self._reply, call, offset)
        return call

    def _reply(self, call: Call, offset: int) -> None:
        length = self.running.pop(offset)
        answer = self._answer(offset, self._data[offset : offset + length])
        if isinstance(answer, NondumError):
            call.fail(answer)
        else:
            call.succeed({"data": answer})


def asked(offset: int, on_cancel: Callable[[int], None] = lambda _: None) -> Call:
    return Call(Request(offset, offset, 1000, "place.read", {}), 0.0, on_cancel)


def listed(data: bytes, path: str = "wheels/a.whl") -> Listed:
    return Listed(path, hashlib.sha256(data).hexdigest(), len(data))


@pytest.mark.parametrize("size", [0, 1, 4095, 4096, 4097, LARGEST, 3 * MOST + 7])
async def test_file_is_whole_afterwards(tmp_path: Path, size: int) -> None:
    data = bytes(range(256)) * (size // 256) + bytes(size % 256)
    owner, told = Owner(data), [0]
    fetching = Fetching(tmp_path, owner.read, told.append)
    await fetching.fetch(listed(data))
    assert (tmp_path / "wheels/a.whl").read_bytes() == data
    assert sum(told) == size
    assert owner.most <= MOST + LARGEST


pieces = st.sampled_from(["cut", "longer", "changed", "text", "failed"])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 300_000), wrong=pieces)
async def test_wrong_piece_is_refused_wherever_it_is(tmp_path: Path, at: int, wrong: str) -> None:
    data = bytes(300_001)

    def answer(offset: int, piece: bytes) -> Any:
        if not offset <= at < offset + len(piece):
            return piece
        failure = CallFailed(Problem("NOT_OFFERED", "not any more"))
        return {
            "cut": piece[:-1],
            "longer": piece + b"\0",
            "changed": b"\1" + piece[1:],
            "text": "0" * len(piece),
            "failed": failure,
        }[wrong]

    owner = Owner(data, answer)
    folder = tmp_path / f"{at}-{wrong}"
    with pytest.raises(NondumError) as refused:
        await Fetching(folder, owner.read).fetch(listed(data))
    assert refused.value.code == ("NOT_OFFERED" if wrong == "failed" else "HASH_MISMATCH")
    (folder / "wheels/a.whl").unlink()


async def test_pieces_that_are_not_wanted_any_more_are_cancelled(tmp_path: Path) -> None:
    cancelled: list[int] = []
    all_asked = asyncio.Event()

    def read(sha256: str, offset: int, length: int) -> Call:
        if offset == (PIECES - 1) * (LEAST // PIECES):
            all_asked.set()
        return asked(offset, cancelled.append)

    fetch = asyncio.create_task(Fetching(tmp_path, read).fetch(listed(bytes(100_000))))
    await all_asked.wait()
    fetch.cancel()
    await asyncio.wait([fetch])
    assert fetch.cancelled()
    assert cancelled == [number * LEAST // PIECES for number in range(PIECES)]


async def test_file_of_a_fetch_that_ends_as_it_begins_is_closed(tmp_path: Path) -> None:
    owner = Owner(b"data")
    fetch = asyncio.create_task(Fetching(tmp_path, owner.read).fetch(listed(b"data")))
    await asyncio.sleep(0)  # it is opening its file from now on
    fetch.cancel()
    await asyncio.wait([fetch])
    assert fetch.cancelled()
    assert not any(entry.endswith("a.whl") for entry in open_files())


def open_files() -> list[str]:
    folder = Path("/proc/self/fd")
    return [str(entry.readlink()) for entry in folder.iterdir() if entry.is_symlink()]
