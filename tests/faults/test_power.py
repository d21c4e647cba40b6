"""The power fails, at whatever write of the disk: what was acknowledged is there.

The long form, `python -m tests.faults`, draws up to a thousand of them.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.faults import power
from tests.faults.points import out_of_place
from tests.faults.power import Life, cuts, fail
from tests.faults.recorded_disk import cut, recorded, writes
from tests.kit.fork_server import Nursery

pytestmark = pytest.mark.slow

CUTS = 3


@pytest.fixture(scope="module")
def life(nursery: Nursery, tmp_path_factory: pytest.TempPathFactory) -> Life:
    if os.geteuid() != 0:
        pytest.skip("mounting needs root")
    return power.live(nursery, tmp_path_factory.mktemp("life"))


@pytest.mark.parametrize("nth", range(CUTS))
def test_power_fails_after_some_write(life: Life, tmp_path: Path, nth: int) -> None:
    after, seed = list(cuts(life, CUTS))[nth]
    ended = fail(life, after, seed, tmp_path)
    assert not ended.wrong
    assert not out_of_place(ended)


def test_what_was_promised_is_on_the_disk_from_then_on(life: Life, tmp_path: Path) -> None:
    """At every promise of that life, with all lost that the disk was not told to flush."""
    at = list(power.promised_after(life))
    assert len(at) > len(power.KEEPS) * 7
    lost = {}
    for after in at:
        folder = tmp_path / str(after)
        folder.mkdir(exist_ok=True)
        lost[after] = power.lost(life, after, folder)
        shutil.rmtree(folder)
    assert {after: wrong for after, wrong in lost.items() if wrong} == {}


def synced(path: Path, data: bytes, *, with_folder: bool) -> None:
    """Write a file in the right order, or forget the last step of it."""
    unfinished = path.with_name(f"{path.name}.part")
    unfinished.write_bytes(data)
    file, folder = os.open(unfinished, os.O_RDONLY), os.open(path.parent, os.O_RDONLY)
    os.fsync(file)
    unfinished.rename(path)
    if with_folder:
        os.fsync(folder)
    for descriptor in (file, folder):
        os.close(descriptor)


@pytest.mark.parametrize("with_folder", [True, False], ids=["synced", "not-synced"])
def test_disk_that_is_cut_off_tells_what_was_not_synced(tmp_path: Path, with_folder: bool) -> None:
    """That the test above could fail: a rename that no folder was synced after is lost."""
    if os.geteuid() != 0:
        pytest.skip("mounting needs root")
    disk, mount, again = tmp_path / "disk", tmp_path / "mount", tmp_path / "again"
    disk.mkdir()
    with recorded(disk, 16, mount) as log:
        synced(mount / "promise", b"kept", with_folder=with_folder)
        length = log.stat().st_size
    done = [write for write in writes(log) if write.end <= length]
    cut(disk / "first", done, random.Random(1))
    again.mkdir()
    subprocess.run(["mount", "-o", "loop", str(disk / "first"), str(again)], check=True)
    try:
        assert (again / "promise").exists() == with_folder
        assert (again / "promise.part").exists() != with_folder
    finally:
        subprocess.run(["umount", str(again)], check=True)
