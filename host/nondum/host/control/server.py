"""The daemon's end of the control socket."""

from __future__ import annotations

import asyncio
import contextlib
import difflib
import errno
import logging
import os
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from pathlib import Path
from typing import Any

from nondum.host.control import protocol
from nondum.host.control.shortage import AcceptFailures
from nondum.sdk.errors import ConfigRefused, NondumError, Problem, ProtocolViolation
from nondum.sdk.frozen import frozen
from nondum.sdk.packets import CROWDED_S, CROWDED_TRIES

Verb = Callable[[Mapping[str, Any]], Awaitable[Any]]
"""Answers once."""
Follow = Callable[[Mapping[str, Any]], AsyncIterator[Any]]
"""Answers until the client leaves."""

MODE = 0o660
"""Of the socket: for its owner and group."""

log = logging.getLogger(__name__)


@frozen
class Handing:
    """An answer that a descriptor goes along with: `connection`, closed here once it is sent."""

    result: Any
    connection: socket.socket


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
        """Start to listen. A socket left by a daemon that died is replaced.

        Raises `ConfigRefused` (CONTROL_IN_USE, CONTROL_SOCKET) where that cannot be.
        """
        try:
            await self._replace_dead_socket()
            listening = _bound(self._path)
            try:
                self._server = await asyncio.start_unix_server(
                    self._serve, sock=listening, limit=protocol.LINE_LIMIT
                )
            except BaseException:
                listening.close()
                raise
        except OSError as error:
            raise _refused("CONTROL_SOCKET", self._path, f"cannot listen ({error})") from error
        asyncio.get_running_loop().set_exception_handler(AcceptFailures())

    async def close(self) -> None:
        """Stop listening and let every client go."""
        if self._server is not None:
            self._server.close()
        for client in list(self._clients):
            client.cancel()
        await asyncio.gather(*self._clients, return_exceptions=True)
        with contextlib.suppress(FileNotFoundError):
            self._path.unlink()

    async def _replace_dead_socket(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        try:
            _, writer = await asyncio.open_unix_connection(self._path)
        except FileNotFoundError:
            return
        except ConnectionRefusedError:
            self._path.unlink()
            return
        writer.close()
        raise _refused("CONTROL_IN_USE", self._path, "another daemon listens there")

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None  # asyncio runs each connection in a task
        self._clients.add(task)
        try:
            line = await reader.readline()
            while line:
                line = await self._answer(line, reader, writer)
        except ValueError:  # how a StreamReader tells of a line past its limit
            writer.write(protocol.encode_problems((_TOO_LONG,)))
        except (ConnectionError, asyncio.CancelledError):
            pass  # the client has left, or the daemon is going
        finally:
            self._clients.discard(task)
            writer.close()

    async def _answer(
        self, line: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> bytes:
        """Answer one line; gives the next, empty when the client has left."""
        try:
            request = protocol.decode_request(line)
            if request.verb in self._follows:
                items = self._follows[request.verb](request.arguments)
                return await _follow(items, reader, writer)
            result = await self._verb(request.verb)(request.arguments)
            if isinstance(result, Handing):
                await _hand(result, writer)
                return await reader.readline()
            answer = protocol.encode_result(result)
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
        return await reader.readline()

    def _verb(self, name: str) -> Verb:
        if name in self._verbs:
            return self._verbs[name]
        near = difflib.get_close_matches(name, self._verbs, n=1)
        fix = f"did you mean {near[0]!r}?" if near else "see `nondum --help`"
        raise ProtocolViolation(
            Problem("CONTROL_VERB", f"unknown verb {name!r}", where="control socket", fix=fix)
        )


def _bound(path: Path) -> socket.socket:
    """A socket at a path, which does not listen yet. At no time does its mode let others in: what
    a socket's own mode refuses, the umask cannot allow (unix(7))."""
    bound = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        os.fchmod(bound.fileno(), MODE)
        bound.bind(str(path))
        path.chmod(MODE)  # the umask may have taken the group's part
    except BaseException:
        bound.close()
        raise
    return bound


async def _hand(handing: Handing, writer: asyncio.StreamWriter) -> None:
    """Send an answer with its descriptor, past asyncio, which sends none (unix(7), SCM_RIGHTS)."""
    line = protocol.encode_result(handing.result)
    with handing.connection:
        writer.transport.set_write_buffer_limits(high=0)
        await writer.drain()  # what was written before goes first
        with writer.get_extra_info("socket").dup() as client:
            try:
                sent = await _sent(client, line, handing.connection.fileno())
            except BlockingIOError as error:
                raise ConnectionError("the client does not read what it asked for") from error
    writer.write(line[sent:])
    await writer.drain()


async def _sent(client: socket.socket, line: bytes, descriptor: int) -> int:
    """Send a line with a descriptor; what stands in the way only for now is waited for."""
    for _ in range(CROWDED_TRIES):
        try:
            return socket.send_fds(client, [line], [descriptor])
        except OSError as error:
            if error.errno != errno.ETOOMANYREFS:  # too many of this user's are under way (unix(7))
                raise
        await asyncio.sleep(CROWDED_S)
    return socket.send_fds(client, [line], [descriptor])


async def _follow(
    items: AsyncIterator[Any], reader: asyncio.StreamReader, writer: asyncio.StreamWriter
) -> bytes:
    """Send items until there are no more or the client sends a line, which is given back."""
    leaving = asyncio.create_task(reader.readline())
    sending = asyncio.create_task(_send_all(items, writer))
    try:
        await asyncio.wait({leaving, sending}, return_when=asyncio.FIRST_COMPLETED)
        if sending.done():
            sending.result()  # raises what went wrong
        return await leaving
    finally:
        for task in (leaving, sending):
            task.cancel()
        await asyncio.gather(leaving, sending, return_exceptions=True)


async def _send_all(items: AsyncIterator[Any], writer: asyncio.StreamWriter) -> None:
    async for item in items:
        writer.write(protocol.encode_result(item))
        await writer.drain()


_TOO_LONG = Problem(
    "CONTROL_REQUEST",
    f"the line is longer than {protocol.LINE_LIMIT} bytes",
    where="control socket",
)


def _refused(code: str, path: Path, message: str) -> ConfigRefused:
    fix = "name another with `control` under [host]"
    return ConfigRefused(Problem(code, message, where=str(path), fix=fix))
