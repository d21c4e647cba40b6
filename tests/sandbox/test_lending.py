"""Devices are lent to the worker that was granted them, where it is a separate user."""

from __future__ import annotations

import os
import pty
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.workers import WorkersUnderTest
from tests.sandbox.guests import does, guest, owner

from nondum.host.sandbox.levels.users import FIRST_USER, is_workers
from nondum.host.workers import granted_nodes
from nondum.host.workers.device_ownership import DeviceOwnership

pytestmark = [
    pytest.mark.anyio,
    pytest.mark.skipif(os.geteuid() != 0, reason="only root can give users to workers"),
]
OPENS = "os.close(os.open({path}, os.O_RDWR | os.O_NOCTTY))"


@pytest.fixture
def has_users() -> bool:
    return True


@pytest.fixture
def line() -> Iterator[str]:
    """A serial line that only root may open."""
    far, near = pty.openpty()
    node = os.ttyname(near)
    Path(node).chmod(0o600)
    yield node
    os.close(far)
    os.close(near)


async def test_device_is_the_workers_for_as_long_as_it_has_it(
    tested: WorkersUnderTest, line: str
) -> None:
    await guest(tested, OPENS.format(path="device.node"))
    for _ in range(2):
        await tested.workers.attach("guest", "line", line, {})
        assert await does(tested) == ""
        assert is_workers(owner(Path(line)))
        await tested.workers.detach("guest", "line")
        assert owner(Path(line)) == 0
    await tested.workers.attach("guest", "line", line, {})
    await tested.workers.stop("guest")
    assert owner(Path(line)) == 0


def test_device_that_everybody_may_open_keeps_its_owner() -> None:
    lending = DeviceOwnership(FIRST_USER)
    lending.lend("it", "/dev/full")
    assert owner(Path("/dev/full")) == 0


def test_device_that_a_daemon_which_died_has_lent_is_roots_again(line: str) -> None:
    os.chown(line, FIRST_USER + 1, -1)
    lending = DeviceOwnership(FIRST_USER)
    lending.lend("it", line)
    lending.take_back("it")
    assert owner(Path(line)) == 0


def test_node_that_is_another_device_by_now_is_left_alone(line: str) -> None:
    lending = DeviceOwnership(FIRST_USER)
    lending.lend("it", line)
    os.chown(line, 1, -1)
    lending.take_back("it")
    assert owner(Path(line)) == 1


@pytest.fixture
def sounds() -> Iterator[Path]:
    """A folder of devices that the group 29 may open, as `/dev/snd` is."""
    folder = Path(f"/dev/nondum-{os.getpid()}")
    folder.mkdir()
    os.mknod(folder / "zero", stat.S_IFCHR, os.makedev(1, 5))
    os.chown(folder / "zero", 0, 29)
    (folder / "zero").chmod(0o660)
    yield folder
    shutil.rmtree(folder)


async def test_worker_is_in_the_groups_of_what_its_permissions_stand_for(
    tested: WorkersUnderTest, sounds: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(granted_nodes, "NODES", {"audio": (str(sounds),)})
    await guest(tested, OPENS.format(path=repr(str(sounds / "zero"))), ("audio",))
    assert await does(tested) == ""
