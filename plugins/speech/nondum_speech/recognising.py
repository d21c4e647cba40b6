"""A recogniser in a separate process.

PocketSphinx holds Python's global lock while it loads its model and while it decodes, seconds on a
small computer: in the worker's own process no heartbeat would be sent meanwhile, and the host would
end a worker that shows no sign of life.
"""

from __future__ import annotations

import asyncio
import os
import pickle
import sys
from typing import Any

from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import Lexicon
from nondum_speech.recogniser import NOTHING, Limits, Recognition
from nondum_speech.requests import LENGTH, Learn, Piece, Says, framed
from nondum_speech.sound import Sound


class RecogniserEnded(Exception):
    """The process ended while it was asked; the next request starts another."""


class Recognising:
    """Asks the process, one request at a time; starts it for the first, and again if it ended."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._learn: Learn | None = None
        self._process: asyncio.subprocess.Process | None = None
        self._one_at_a_time = asyncio.Lock()

    @property
    def pid(self) -> int | None:
        """The process's number, while it runs."""
        is_up = self._process is not None and self._process.returncode is None
        return self._process.pid if self._process and is_up else None

    async def learn(self, vocabulary: Vocabulary, lexicon: Lexicon) -> None:
        """Hear other words from now on. Raises `RecogniserEnded`."""
        self._learn = Learn(vocabulary, lexicon, self._limits)
        await self._asked(self._learn)

    async def hear(self, sound: Sound) -> Recognition:
        """Recognise one sentence. Raises `RecogniserEnded`."""
        heard: Recognition = await self._asked(sound) if self._learn else NOTHING
        return heard

    async def says(self, sound: Sound) -> None:
        """The robot itself says this from now on. Raises `RecogniserEnded`."""
        if self._learn:
            await self._asked(Says(sound))

    async def stop_in(self, piece: Sound) -> str:
        """Words that stop, if somebody said them in what is heard while the robot says something;
        pieces come as they were heard, one after the other. Raises `RecogniserEnded`."""
        words: str = await self._asked(Piece(piece)) if self._learn else ""
        return words

    async def close(self) -> None:
        """End the process."""
        if self._process is not None and self._process.returncode is None:
            self._process.kill()
            await self._process.wait()

    async def _asked(self, request: object) -> Any:
        # The caller may be cancelled; the answer is read all the same, or the next call gets it.
        return await asyncio.shield(asyncio.create_task(self._answer(request)))

    async def _answer(self, request: object) -> Any:
        async with self._one_at_a_time:
            try:
                if self.pid is None:
                    self._process = await _started()
                    if self._learn is not None and self._learn is not request:
                        await self._exchange(self._learn)
                return await self._exchange(request)
            except (OSError, asyncio.IncompleteReadError) as error:
                await self.close()
                status = self._process.returncode if self._process else None
                raise RecogniserEnded(f"the recogniser ended with status {status}") from error

    async def _exchange(self, request: object) -> Any:
        process = self._process
        assert process is not None and process.stdin is not None and process.stdout is not None
        process.stdin.write(framed(request))
        await process.stdin.drain()
        (length,) = LENGTH.unpack(await process.stdout.readexactly(LENGTH.size))
        return pickle.loads(await process.stdout.readexactly(length))


async def _started() -> asyncio.subprocess.Process:
    pipe = asyncio.subprocess.PIPE
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-P", "-m", "nondum_speech.recogniser_process"),
        stdin=pipe,
        stdout=pipe,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
