"""A language model in GGUF, held by a process of its kind: loaded, asked, and ended."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from nondum.sdk.errors import BehaviourFailed, ConfigRefused, Problem
from nondum_language_model.settings import Settings

_LONGEST = 1 << 20
"""Bytes of a line that the process says."""


class Model:
    """Answers with JSON of a schema. Make it with `load`."""

    def __init__(self, process: Process, settings: Settings) -> None:
        self._process, self._seconds = process, settings.seconds
        self._exchange: asyncio.Task[dict[str, Any]] | None = None
        """The newest question; it is answered whether or not somebody still waits."""

    @classmethod
    async def load(cls, weights: Path, settings: Settings, folder: Path) -> Model:
        """Start a process and have it load `weights`; takes its time. What it needs on the way is
        in `folder`. Raises `ConfigRefused` (WEIGHTS_UNREADABLE), `BehaviourFailed` (MODEL_ENDED).
        """
        told = (str(weights), json.dumps(asdict(settings)), str(folder))
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "nondum_language_model.model_process", *told),
            stdin=PIPE,
            stdout=PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            limit=_LONGEST,
        )
        model = cls(process, settings)
        try:
            said = await model._line()
            if "refused" in said:
                raise _unreadable(str(weights), said["refused"])
        except BaseException:
            await model.end()
            raise
        return model

    async def answer(self, instructions: str, words: str, schema: Mapping[str, Any]) -> str:
        """What it says to a person's words: JSON of `schema`, but for one that ignores it.

        Raises `BehaviourFailed`: MODEL_OVERDUE when it takes too long, MODEL_REFUSED where
        llama.cpp does, as of more words than fit into the context, MODEL_ENDED.
        """
        asked = {"instructions": instructions, "words": words, "schema": dict(schema)}
        try:
            async with asyncio.timeout(self._seconds):
                while self._exchange is not None and not self._exchange.done():
                    await asyncio.wait({self._exchange})
                self._exchange = asyncio.create_task(self._asked(asked))
                said = await asyncio.shield(self._exchange)
        except TimeoutError as error:
            raise self._overdue() from error
        if said.get("is_overdue"):
            raise self._overdue()
        if "refused" in said:
            raise BehaviourFailed(f"llama.cpp: {said['refused']}", code="MODEL_REFUSED")
        return str(said["answer"])

    async def end(self) -> None:
        """End the process."""
        if self._exchange is not None:
            self._exchange.cancel()
        if self._process.returncode is None:
            self._process.kill()
        await self._process.wait()

    async def _asked(self, request: Mapping[str, Any]) -> dict[str, Any]:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{json.dumps(request)}\n".encode())
        return await self._line()

    async def _line(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = await self._process.stdout.readline()
        if not line:
            status = await self._process.wait()
            raise BehaviourFailed(
                f"the model's process ended with status {status}", code="MODEL_ENDED"
            )
        said: dict[str, Any] = json.loads(line)
        return said

    def _overdue(self) -> BehaviourFailed:
        return BehaviourFailed(f"no answer within {self._seconds:g} s", code="MODEL_OVERDUE")


def _unreadable(where: str, why: str) -> ConfigRefused:
    fix = "put a model in GGUF that llama.cpp can read on the drive, and one that fits the memory"
    return ConfigRefused(Problem("WEIGHTS_UNREADABLE", why, where=where, fix=fix))
