"""Connections that become no peers are counted once."""

from __future__ import annotations

import socket

from nondum.transport.peers import accepted


def test_connection_that_has_spoken_is_not_counted_when_it_ends() -> None:
    known = accepted.AcceptedConnections()
    with socket.create_server(("127.0.0.1", 0)) as server:
        for has_spoken in (False, True):
            with socket.create_connection(server.getsockname()), server.accept()[0] as there:
                list(known.opened(there.fileno(), 0.0))
                if has_spoken:
                    known.spoke(there.fileno(), 0.0)
                assert known.closed(there.fileno()) is not has_spoken
