"""Names to addresses, without holding up anything: neither the loop nor the end of the process.

(The executors of `asyncio` and `concurrent.futures` are waited for at the end, and a name server
that does not answer takes half a minute to give up on.)
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import ipaddress
import socket
import threading
from collections.abc import Callable
from functools import partial

MAX_FOUND = 8


async def resolve(host: str, port: int) -> tuple[str, ...]:
    """The IP addresses of a host; those of one link have their scope.

    Raises `OSError` when there is none, or no thread to look them up in.
    """
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(host)
        return (host,)
    loop = asyncio.get_running_loop()
    found: asyncio.Future[tuple[str, ...]] = loop.create_future()

    def look_up() -> None:
        try:
            ends = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
            names = tuple(dict.fromkeys(str(end[4][0]) for end in ends))[:MAX_FOUND]
            tell(partial(_settle, found, names))
        except OSError as error:
            tell(partial(_settle, found, error))

    def tell(what: Callable[[], None]) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: nothing waits any more
            loop.call_soon_threadsafe(what)

    try:
        threading.Thread(target=look_up, name=f"resolve {host}", daemon=True).start()
    except RuntimeError as error:  # as Python says that the system gives no thread
        raise OSError(errno.EAGAIN, str(error)) from error
    return await found


def _settle(found: asyncio.Future[tuple[str, ...]], outcome: tuple[str, ...] | OSError) -> None:
    if found.done():
        return
    if isinstance(outcome, OSError):
        found.set_exception(outcome)
    else:
        found.set_result(outcome)
