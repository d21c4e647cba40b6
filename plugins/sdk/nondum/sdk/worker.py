"""A worker process's main function: one plugin, one link, nothing else inherited."""

from __future__ import annotations

import asyncio
import faulthandler
import logging
import os
import socket
import sys
import traceback

from nondum.sdk.errors import NondumError
from nondum.sdk.logs import EventHandler
from nondum.sdk.packets import SocketPackets
from nondum.sdk.plugin import load
from nondum.sdk.session import HEARTBEAT_S, Session
from nondum.sdk.wire import MAX_PACKET

STALL_S = 2 * HEARTBEAT_S
"""How long the loop may stand still before it is written down where."""


def main(fd: int, entry_point: str, distribution: str) -> None:
    """Serve the host at descriptor `fd` until it hangs up; does not return.

    `entry_point` is `module` or `module:attribute`; `distribution` owns it.
    """
    status = 1
    try:
        asyncio.run(_serve(socket.socket(fileno=fd), entry_point, distribution))
        status = 0
    except NondumError as error:
        sys.stderr.write(f"{error}\n")  # captured by the host: there is no link to tell it by
    except KeyboardInterrupt:
        pass  # the terminal's interrupt reaches the whole group; the host does the rest
    except Exception:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        sys.stdout.flush()
        os._exit(status)  # threads that never end must not keep the process


def _await_next_beat() -> None:
    """Write where every thread stands to standard error unless this is called again in time: soon
    the host ends a worker whose loop stands still, and its author should know where it stood."""
    faulthandler.dump_traceback_later(STALL_S)


async def _serve(sock: socket.socket, entry_point: str, distribution: str) -> None:
    session = Session(
        SocketPackets(sock, MAX_PACKET), lambda: load(entry_point, distribution), _await_next_beat
    )
    root = logging.getLogger()
    root.setLevel(logging.INFO)
    root.addHandler(EventHandler(session.tell))
    await session.run()
