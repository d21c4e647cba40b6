"""What other users of the machine see of a host: nothing of what it keeps, and no way to it."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest
from tests.daemon.plugins import TALKER, talker
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost

from nondum.host.sandbox.levels.users import is_workers

pytestmark = pytest.mark.daemon


def test_other_users_can_open_nothing_that_a_host_keeps(own_host: RunningHost) -> None:
    own_host.bring("talker", talker())
    own_host.until_component("talker", "ready")
    root = own_host.state
    assert stat.S_IMODE(root.stat().st_mode) == 0o700
    for name in ("catalogue.sqlite", "catalogue.sqlite-wal", "catalogue.sqlite-shm"):
        assert stat.S_IMODE((root / name).stat().st_mode) == 0o600, name
    assert list(root.glob("scratch/*/talker")), "a scratch folder to be reached"


def test_state_folder_of_an_older_version_is_closed_at_the_next_start(
    own_host: RunningHost,
) -> None:
    own_host.stop()
    opened = [own_host.state, *(p for p in own_host.state.iterdir() if not p.is_symlink())]
    for path in opened:
        path.chmod(0o755 if path.is_dir() else 0o644)
    own_host.start()
    assert [p for p in opened if is_open(p)] == []


PLAYS = """
import os, pathlib

def play():
    deep = pathlib.Path("games")
    for _ in range(30):
        deep.mkdir()
        (deep / "file").write_text("x")
        deep /= "d" * 50
    for folder, folders, files in os.walk("games", topdown=False):
        for name in (*folders, *files):
            os.chmod(f"{folder}/{name}", 0)
    os.chmod("games", 0)
    os.chmod(".", 0)

if "NONDUM_WORKER" in os.environ:  # and not where the payload is built
    play()
"""


def test_nothing_is_left_of_a_scratch_folder_whatever_the_worker_did_to_it(
    own_host: RunningHost,
) -> None:
    own_host.bring("talker", Part("talker", TALKER + PLAYS))
    own_host.until_component("talker", "ready")
    (scratch,) = own_host.state.glob("scratch/*/talker")
    if own_host.ask("status")["confinement"]["users"]:
        assert is_workers(scratch.stat().st_uid)
    assert (scratch / "games").exists()
    own_host.clear()
    assert not list(own_host.state.glob("scratch/*"))


def is_open(path: Path) -> bool:
    return path.exists() and bool(path.lstat().st_mode & 0o077)
