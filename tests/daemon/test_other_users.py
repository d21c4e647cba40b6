"""What other users of the machine see of a host: nothing of what it keeps, and no way to it."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest
from tests.daemon.plugins import talker
from tests.kit.running_host import RunningHost

pytestmark = pytest.mark.daemon


def test_nothing_that_a_host_keeps_is_open_to_others(own_host: RunningHost) -> None:
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


def is_open(path: Path) -> bool:
    return path.exists() and bool(path.lstat().st_mode & 0o077)
