"""Connections are known by descriptors, which may have gone to something else meanwhile."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from nondum.transport.peers import tcp


def test_descriptor_that_is_no_socket_any_more_leaves_nothing_open() -> None:
    descriptor = os.eventfd(0)
    before = open_files()
    assert tcp.other_end(descriptor) == ""
    assert tcp.state(descriptor) is None
    tcp.cut(descriptor, "127.0.0.1:1")
    assert open_files() == before
    os.close(descriptor)


@pytest.mark.parametrize("family", [socket.AF_NETLINK, socket.AF_UNIX], ids=["netlink", "unix"])
def test_descriptor_that_is_another_kind_of_socket_now_has_no_other_end(family: int) -> None:
    """A netlink socket has a peer whose address begins with a number."""
    with socket.socket(family, socket.SOCK_DGRAM) as other:
        assert tcp.other_end(other.fileno()) == ""
        assert tcp.state(other.fileno(), "127.0.0.1:1") is None
        tcp.cut(other.fileno(), "127.0.0.1:1")


def test_connection_to_another_end_is_not_cut() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(server.getsockname()) as here,
    ):
        there, (host, port) = server.accept()
        with there:
            assert tcp.other_end(there.fileno()) == f"{host}:{port}"
            tcp.cut(there.fileno(), f"{host}:{port + 1}")
            here.sendall(b"still here")
            assert there.recv(10) == b"still here"
            state = tcp.state(there.fileno())
            assert state is not None
            assert state.bytes_received == state.bytes_read == 10
            tcp.cut(there.fileno(), f"{host}:{port}")
            assert here.recv(1) == b""


def open_files() -> list[str]:
    return sorted(path.name for path in Path("/proc/self/fd").iterdir())
