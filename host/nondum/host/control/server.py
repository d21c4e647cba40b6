"""The daemon's end of the control socket."""

from __future__ import annotations

import asyncio
import contextlib
import difflib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from nondum.host.control import protocol
from nondum.sdk.errors import NondumError, Problem, ProtocolViolation

Verb = Callable[[Mapping[str, Any]], Awaitable[Any]]
"""Answers once."""
Follow = Callable[[Mapping[str, Any]], AsyncIterator[Any]]
"""Answers until the client leaves."""

log = logging.getLogger(__name__)


class ControlServer:
    """Serves verbs on a local socket that only its owner (and group) may open."""

    def __init__(
        self, path: Path, verbs: Mapping[str, Verb], follows: Mapping[str, Follow]
    ) -> None:
        self._path = path
        self._verbs = verbs
        self._follows = follows
        self._server: asyncio.Server | None = None
        self._clients: set[asyncio.Task[None]] = set()

    async def open(self) -> None:
        """Start to listen. A socket left by a daemon that died is replaced."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileNotFoundError):
            self._path.unlink()
        self._server = await asyncio.start_unix_server(
            self._serve, path=self._path, limit=protocol.LINE_LIMIT
        )
        self._path.chmod(0o660)

    async def close(self) -> None:
        """Stop listening and let every client go."""
        if self._server is not None:
            self._server.close()
        for client in list(self._clients):
            client.cancel()
        await asyncio.gather(*self._clients, return_exceptions=True)
        with contextlib.suppress(FileNotFoundError):
            self._path.unlink()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None  # asyncio runs each connection in a task
        self._clients.add(task)
        try:
            while line := await reader.readline():
                await self._answer(line, writer)
        except (ConnectionError, ValueError, asyncio.CancelledError):
            pass  # the client left, or sent a line past the limit: nothing to tell it
        finally:
            self._clients.discard(task)
            writer.close()

    async def _answer(self, line: bytes, writer: asyncio.StreamWriter) -> None:
        try:
            request = protocol.decode_request(line)
            if request.verb in self._follows:
                async for item in self._follows[request.verb](request.arguments):
                    writer.write(protocol.encode_result(item))
                    await writer.drain()
                return
            answer = protocol.encode_result(await self._verb(request.verb)(request.arguments))
        except NondumError as error:
            answer = protocol.encode_problems(error.problems)
        except ConnectionError:
            raise
        except Exception as error:
            # A fault of the daemon's own: the client hears of it, the log keeps the traceback.
            log.exception("control request failed: %r", line[:200])
            fault = Problem("INTERNAL", f"{type(error).__name__}: {error}", where="daemon")
            answer = protocol.encode_problems((fault,))
        writer.write(answer)
        await writer.drain()

    def _verb(self, name: str) -> Verb:
        if name in self._verbs:
            return self._verbs[name]
        near = difflib.get_close_matches(name, self._verbs, n=1)
        fix = f"did you mean {near[0]!r}?" if near else "see `nondum --help`"
        raise ProtocolViolation(
            Problem("CONTROL_VERB", f"unknown verb {name!r}", where="control socket", fix=fix)
        )
