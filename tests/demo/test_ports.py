"""A port that was given away stays free for its receiver; no one else gets it."""

from __future__ import annotations

import socket

import pytest
from demo.ports import free_port


def test_a_daemon_may_listen_at_its_port_and_no_one_else_gets_it() -> None:
    port = free_port()
    with socket.create_server(("127.0.0.1", port)), pytest.raises(OSError):
        socket.create_server(("127.0.0.1", port))


def test_no_port_is_given_twice() -> None:
    ports = [free_port() for _ in range(50)]
    with socket.create_server(("127.0.0.1", 0)) as other:
        assert len({*ports, other.getsockname()[1]}) == 51
