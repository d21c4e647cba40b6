"""Ports of this machine's loopback for daemons that are not started yet."""

from __future__ import annotations

import socket


def free_port() -> int:
    """A port that the kernel gives to no other program while this process lives, except to one that
    binds it by its number with SO_REUSEADDR, as daemons do."""
    reserved = socket.socket()
    reserved.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    reserved.bind(("127.0.0.1", 0))
    port: int = reserved.getsockname()[1]
    reserved.detach()
    return port
