"""One daemon for a module of tests, with a payload that it has never seen plugged in."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import pytest
from tests.kit.beacon import BEACON, HOST
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost, running


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningHost]:
    unwatched = "[workers]\nsettle_beats = 0\n"  # newer releases take over at once
    with running(tmp_path_factory.mktemp("host"), name=HOST, more=unwatched) as daemon:
        daemon.bring("beacon", Part("beacon", BEACON))
        daemon.until(
            "the beacon is ready", lambda view: any(row["ready"] for row in view["components"])
        )
        yield daemon


class Answering(Protocol):
    """Makes a socket whose daemon answers questions, whatever they are, with these in turn."""

    def __call__(self, *answers: bytes, hangs_up: bool = True) -> Path: ...


@pytest.fixture
def answering(tmp_path: Path) -> Iterator[Answering]:
    listeners: list[socket.socket] = []
    threads: list[threading.Thread] = []

    def serve(listener: socket.socket, answers: tuple[bytes, ...], hangs_up: bool) -> None:
        for answer in answers:
            connection, _ = listener.accept()
            with connection, connection.makefile("rb") as lines:
                lines.readline()
                connection.sendall(answer)
                if not hangs_up:
                    lines.readline()  # until the other end leaves

    def answering(*answers: bytes, hangs_up: bool = True) -> Path:
        path = tmp_path / "answering.sock"
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(str(path))
        listener.listen()
        threads.append(threading.Thread(target=serve, args=(listener, answers, hangs_up)))
        threads[-1].start()
        listeners.append(listener)
        return path

    yield answering
    for thread in threads:
        thread.join(timeout=30)
    for listener in listeners:
        listener.close()
