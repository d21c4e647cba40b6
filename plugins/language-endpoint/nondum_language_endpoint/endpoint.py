"""A server that answers as OpenAI's does: `POST …/chat/completions`, with a JSON schema.

llama.cpp, vLLM and ollama do. Nothing that it answers is trusted: its time and its bytes are
limited, it is followed to no other place, and its caller checks that it says what the schema has.
"""

from __future__ import annotations

import asyncio
import http.client
import json
import socket
import ssl
from collections.abc import Mapping
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from nondum.sdk.errors import BehaviourFailed
from nondum_language_endpoint.settings import Settings

MOST_BYTES = 1_000_000
"""Of an answer."""
_OK = 200


async def answer(
    settings: Settings, instructions: str, words: str, schema: Mapping[str, Any]
) -> str:
    """What the model says to a person's words.

    Raises `BehaviourFailed`: ENDPOINT_UNREACHABLE, ENDPOINT_TLS, ENDPOINT_STATUS, ENDPOINT_ANSWER,
    ENDPOINT_TOO_LONG, ENDPOINT_OVERDUE.
    """
    exchange = _Exchange(settings)
    request = _request(settings, instructions, words, schema)
    try:
        async with asyncio.timeout(settings.seconds):
            return _content(await asyncio.to_thread(exchange.run, request))
    except TimeoutError as error:
        told = f"no answer within {settings.seconds:g} s"
        raise BehaviourFailed(told, code="ENDPOINT_OVERDUE") from error
    finally:
        exchange.end()


def _request(settings: Settings, instructions: str, words: str, schema: Mapping[str, Any]) -> bytes:
    form = {"name": "goal", "strict": True, "schema": dict(schema)}
    asked = {
        "model": settings.model,
        "messages": [
            {"role": "system", "content": instructions},
            {"role": "user", "content": words},
        ],
        "response_format": {"type": "json_schema", "json_schema": form},
        "max_tokens": settings.answer_tokens,
        "temperature": 0,
        "stream": False,
    }
    return json.dumps(asked).encode()


def _content(body: bytes) -> str:
    """What the model says, in what the server does. Raises `BehaviourFailed`."""
    try:
        said = json.loads(body)
    except (ValueError, RecursionError) as error:
        raise _wrong(body) from error
    match said:
        case {"choices": [{"message": {"content": str(content)}}, *_]}:
            return content
    raise _wrong(body)


def _wrong(body: bytes) -> BehaviourFailed:
    told = f"it does not answer as servers of language models do: {body[:100]!r}"
    return BehaviourFailed(told, code="ENDPOINT_ANSWER")


class _Exchange:
    """One request and its answer, in a thread; `end` breaks it off from another."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._url = urlsplit(settings.url)
        self._socket: socket.socket | None = None
        self._is_over = False

    def run(self, request: bytes) -> bytes:
        """Blocks. Raises `BehaviourFailed`."""
        connection = self._connection()
        try:
            self._connect(connection)
            path = f"{self._url.path.rstrip('/')}/chat/completions"
            connection.request("POST", path, request, self._headers())
            response = connection.getresponse()
            if response.status != _OK:
                told = f"it answers {response.status} {response.reason}"
                raise BehaviourFailed(told[:200], code="ENDPOINT_STATUS")
            body = response.read(MOST_BYTES + 1)
        except ssl.SSLError as error:
            raise BehaviourFailed(f"its certificate: {error}", code="ENDPOINT_TLS") from error
        except http.client.HTTPException as error:
            raise _wrong(repr(error).encode()) from error
        except (OSError, UnicodeError) as error:  # the latter of a name that is none
            told = f"{self._url.netloc.rpartition('@')[2]}: {error}"
            raise BehaviourFailed(told, code="ENDPOINT_UNREACHABLE") from error
        finally:
            connection.close()
        if len(body) > MOST_BYTES:
            told = f"its answer is longer than {MOST_BYTES} bytes"
            raise BehaviourFailed(told, code="ENDPOINT_TOO_LONG")
        return body

    def end(self) -> None:
        """Have a thread that still waits for the server wait no longer."""
        self._is_over = True
        if self._socket is not None:
            with suppress(OSError):  # it has ended
                self._socket.shutdown(socket.SHUT_RDWR)

    def _connect(self, connection: http.client.HTTPConnection) -> None:
        """Connect to the server, which proves itself; by sockets that `end` can shut."""
        where = connection.host, connection.port
        context = self._context() if self._url.scheme == "https" else None
        found = socket.create_connection(where, self._settings.seconds)
        connection.sock = self._socket = found
        if context is not None:
            secure = context.wrap_socket(
                found, server_hostname=connection.host, do_handshake_on_connect=False
            )
            connection.sock = self._socket = secure
            if not self._is_over:
                secure.do_handshake()
        if self._is_over:
            raise OSError("it was too late")

    def _connection(self) -> http.client.HTTPConnection:
        is_plain = self._url.scheme == "http"
        kind = http.client.HTTPConnection if is_plain else http.client.HTTPSConnection
        return kind(self._url.hostname or "", self._url.port, timeout=self._settings.seconds)

    def _context(self) -> ssl.SSLContext:
        try:
            return ssl.create_default_context(cadata=self._settings.authority or None)
        except ssl.SSLError as error:
            told = f"`authority` in its settings is no certificate: {error}"
            raise BehaviourFailed(told, code="ENDPOINT_TLS") from error

    def _headers(self) -> dict[str, str]:
        headers = {"Content-Type": "application/json", "Accept": "application/json"}
        if self._settings.key:
            headers["Authorization"] = f"Bearer {self._settings.key}"
        return headers
