"""A device is granted although the helper is only just starting, or has no time."""

from __future__ import annotations

import os
import pwd
import socket
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from nondum.host.rpc.outcomes import packed
from nondum.host.sandbox.helper import HelperClient, requests
from nondum.host.sandbox.helper.grants import TIMES, reachable
from nondum.sdk.wire import MAX_PACKET, Reply, encode

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="making device nodes needs root")
USER = pwd.getpwnam("daemon").pw_uid
MADE = "/run/nondum-helper/devices/eye/line"


@contextmanager
def helper(
    folder: Path, *, hangs_up: int, then: Callable[[], object] = lambda: None
) -> Iterator[tuple[HelperClient, list[bytes]]]:
    """One that ends so often without an answer, as when it is killed while it starts; and what it
    is asked. `then` is done whenever it is asked."""
    path, asked = folder / "helper.sock", list[bytes]()

    def serve() -> None:
        with suppress(OSError):  # the test is over
            while True:
                connection, _ = listening.accept()
                with connection:
                    asked.append(connection.recv(MAX_PACKET))
                    then()
                    if len(asked) > hangs_up:
                        connection.send(encode(Reply(requests.CALL, packed({"at": MADE}))))

    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(str(path))
        listening.listen()
        serving = threading.Thread(target=serve)
        serving.start()
        yield HelperClient(path), asked
        listening.shutdown(socket.SHUT_RDWR)
        serving.join()


@pytest.fixture
def node(tmp_path: Path) -> str:
    """A device that no worker may open."""
    made = tmp_path / "ttyUSB0"
    os.mknod(made, 0o600 | stat.S_IFCHR, os.makedev(188, 0))
    return str(made)


@pytest.mark.parametrize("hangs_up", [0, 1, TIMES - 1])
def test_helper_that_only_starts_is_asked_again(tmp_path: Path, node: str, hangs_up: int) -> None:
    with helper(tmp_path, hangs_up=hangs_up) as (client, asked):
        assert reachable("eye", "line", node, USER, by=client) == MADE
    assert len(asked) == hangs_up + 1


def test_helper_that_never_answers_is_left_and_the_device_shown_as_it_is(
    tmp_path: Path, node: str
) -> None:
    with helper(tmp_path, hangs_up=TIMES) as (client, asked):
        assert reachable("eye", "line", node, USER, by=client) == node
    assert len(asked) == TIMES


def test_device_that_is_pulled_meanwhile_is_not_asked_for_again(tmp_path: Path, node: str) -> None:
    with helper(tmp_path, hangs_up=TIMES, then=Path(node).unlink) as (client, asked):
        assert reachable("eye", "line", node, USER, by=client) == node
    assert len(asked) == 1
