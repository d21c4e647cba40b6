"""An emulator's port on a unix socket: it reads from its client; clients may come and go."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from demo.emulators.socket_port import SocketPort

SOON_S = 20.0
"""Longer than anything takes here."""


@pytest.fixture
def port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SocketPort]:
    monkeypatch.chdir(tmp_path)  # the path of a socket must be short
    made = SocketPort(Path("line"))
    yield made
    made.close()


def adapter(port: SocketPort) -> socket.socket:
    """What QEMU does for a serial adapter, seen by the emulator."""
    connected = socket.socket(socket.AF_UNIX)
    connected.settimeout(SOON_S)
    connected.connect(port.path)
    assert port.read(SOON_S) == b""
    return connected


def test_bytes_go_both_ways(port: SocketPort) -> None:
    with adapter(port) as line:
        line.sendall(b"PP ")
        assert port.read(SOON_S) == b"PP "
        assert port.write(b"* 22\r\n") == 6
        assert line.recv(64) == b"* 22\r\n"


def test_what_no_client_receives_is_lost(port: SocketPort) -> None:
    assert port.write(b"lost") == 0
    with adapter(port) as line:
        port.write(b"heard")
        assert line.recv(64) == b"heard"


def test_a_line_that_no_client_reads_holds_little(port: SocketPort) -> None:
    with adapter(port):
        sent = [port.write(b"x" * 100) for _ in range(10_000)]
        assert sent[-1] == 0
        assert sum(sent) < 100_000


def test_a_pulled_adapter_may_come_again(port: SocketPort) -> None:
    with adapter(port):
        pass
    assert port.read(SOON_S) == b""
    assert port.write(b"lost") == 0
    with adapter(port) as line:
        port.write(b"heard")
        assert line.recv(64) == b"heard"
