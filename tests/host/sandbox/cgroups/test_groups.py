"""Cgroups: limits on all of a worker's processes together, and their sure end, on this machine; on
trees of files that look like other machines', what is found and written there."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.descriptors import descriptors_left

from nondum.host.sandbox.cgroups import CgroupLimits, Cgroups
from nondum.host.sandbox.cgroups.groups import Cgroup, NoTree, known, problems_of, tree
from nondum.host.sandbox.cgroups.hierarchies import Mounted, mounted
from nondum.host.sandbox.cgroups.version1 import Version1
from nondum.host.sandbox.cgroups.version2 import Version2

REAL = pytest.mark.skipif(os.geteuid() != 0, reason="making cgroups needs root")
BOMB = "import os,sys\nsys.stdin.read(1)\nwhile True:\n    try: os.fork()\n    except OSError: pass"
HOG = "import sys,mmap\nsys.stdin.read(1)\nheld=[]\nwhile True:\n"
HOG += "    held.append(mmap.mmap(-1,1<<20)); held[-1].write(bytes(1<<20))"


@pytest.fixture
def cgroups(tmp_path: Path) -> Iterator[Cgroups]:
    """This machine's."""
    made = Cgroups.open(tmp_path)
    assert made.holds == {"memory", "pids", "cpu"}
    assert made.problems() == ()
    yield made
    assert made.sweep() == 0
    made.close()


def begin(code: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)


def let_go(process: subprocess.Popen[bytes]) -> None:
    assert process.stdin is not None
    process.stdin.write(b"x")
    process.stdin.close()


@REAL
def test_fork_bomb_stays_small_and_ends_whole(cgroups: Cgroups) -> None:
    cgroup = cgroups.make("bomb", CgroupLimits(tasks=20))
    process = begin(BOMB)
    cgroup.add(process.pid)
    let_go(process)
    while cgroup.usage().refused_tasks < 100:
        pass
    assert cgroup.usage().tasks <= 20
    held = cgroup.pids()
    assert process.pid in held
    assert cgroup.end()
    assert process.wait() == -signal.SIGKILL
    assert cgroup.pids() == ()
    assert cgroups.sweep() == 0


@REAL
def test_hog_is_killed_and_counted(cgroups: Cgroups) -> None:
    cgroup = cgroups.make("hog", CgroupLimits(memory_mb=64))
    process = begin(HOG)
    cgroup.add(process.pid)
    let_go(process)
    assert process.wait() == -signal.SIGKILL
    assert cgroup.usage().oom_kills == 1
    assert cgroup.end()


@REAL
@pytest.mark.parametrize(("first_mb", "then_mb", "status"), [(16, 128, 0), (128, 16, -9)])
def test_limits_of_a_cgroup_are_raised_and_lowered(
    cgroups: Cgroups, first_mb: int, then_mb: int, status: int
) -> None:
    """As those of a spare worker, which has the usual ones until a component takes it."""
    cgroup = cgroups.make("spare", CgroupLimits(memory_mb=first_mb))
    cgroup.limit(CgroupLimits(memory_mb=then_mb))
    process = begin("import sys\nsys.stdin.read(1)\nheld = bytearray(64 << 20)\n")
    cgroup.add(process.pid)
    let_go(process)
    assert process.wait() == status
    assert cgroup.end()


@REAL
def test_children_that_were_there_before_come_along(cgroups: Cgroups) -> None:
    code = "import subprocess,sys\np=subprocess.Popen(['sleep','60'])\nprint(p.pid,flush=True)\n"
    process = subprocess.Popen(
        [sys.executable, "-c", f"{code}p.wait()"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    child = int(process.stdout.readline())
    cgroup = cgroups.make("parent", CgroupLimits())
    cgroup.add(process.pid)
    assert {process.pid, child} <= set(cgroup.pids())
    assert cgroup.end()
    process.wait()
    process.stdout.close()


@REAL
def test_sweep_ends_what_an_earlier_daemon_left(tmp_path: Path, cgroups: Cgroups) -> None:
    process = begin("input()")
    cgroups.make("left", CgroupLimits()).add(process.pid)
    kept = cgroups.make("kept", CgroupLimits())
    again = Cgroups.open(tmp_path)
    assert again.sweep(keep=[kept.name]) == 1
    assert process.wait() == -signal.SIGKILL
    assert process.stdin is not None
    process.stdin.close()
    assert again.make("left", CgroupLimits()).name not in ("left.1", kept.name)
    again.sweep()


@REAL
def test_other_daemon_s_cgroups_are_left_alone(tmp_path: Path, cgroups: Cgroups) -> None:
    cgroups.make("mine", CgroupLimits())
    other = Cgroups.open(tmp_path / "other")
    assert other.sweep() == 0
    other.close()
    assert cgroups.sweep() == 1


def test_limits_that_are_none_are_refused() -> None:
    for wrong in ({"memory_mb": 0}, {"tasks": -1}, {"cpu_weight": 0}, {"processors": -0.1}):
        with pytest.raises(ValueError, match="no "):
            CgroupLimits(**wrong)


def unified(top: Path, controllers: str) -> Path:
    """A version 2 hierarchy, as files, with a service in it."""
    own = top / "nondum.service"
    for part in (top, own, own / "nondum-x"):
        part.mkdir(parents=True, exist_ok=True)
        (part / "cgroup.controllers").write_text(controllers)
        (part / "cgroup.subtree_control").write_text(controllers)
        (part / "cgroup.procs").write_text("")
    return own


def test_lent_part_of_version_2_is_limited_in_all(tmp_path: Path) -> None:
    own = unified(tmp_path, "cpuset cpu io memory pids")
    made = Version2.open(own, tmp_path, "nondum-x")
    assert made is not None
    assert made.controllers == {"memory", "pids", "cpu"}
    cgroup = own / "nondum-x/lamp.1"
    made.make("lamp.1")
    for name in ("memory.max", "memory.oom.group", "pids.max", "cpu.weight", "cpu.max"):
        (cgroup / name).write_text("")
    made.limit("lamp.1", CgroupLimits(memory_mb=64, tasks=9, cpu_weight=50, processors=0.5))
    assert {file.name: file.read_text() for file in cgroup.iterdir()} == {
        "memory.max": str(64 << 20),
        "memory.oom.group": "1",
        "pids.max": "9",
        "cpu.weight": "50",
        "cpu.max": "50000 100000",
    }


def test_version_2_without_memory_says_what_to_write_where(tmp_path: Path) -> None:
    """Raspberry Pi OS as it is delivered."""
    own = unified(tmp_path, "cpuset cpu io pids")
    found = tree([Mounted(tmp_path, own, frozenset())], "nondum-x")
    assert found.controllers == {"pids", "cpu"}
    here = known("memory 0 1 0\npids 0 1 1\ncpu 0 1 1\n")
    (problem,) = problems_of(found, here)
    assert problem.code == "CGROUP_MEMORY_MISSING"
    assert "cmdline.txt" in problem.fix


def test_where_nothing_may_be_made_it_is_said(tmp_path: Path) -> None:
    found = tree([], "nondum-x")
    assert isinstance(found, NoTree)
    cgroups = Cgroups(found)
    assert not cgroups.holds
    cgroup = cgroups.make("lamp", CgroupLimits())
    cgroup.add(os.getpid())
    assert cgroup.end()
    assert "CGROUPS_WITHHELD" in [problem.code for problem in cgroups.problems()]


def test_version_1_is_taken_controller_by_controller(tmp_path: Path) -> None:
    hierarchies = []
    for names in ("memory", "pids", "cpu,cpuacct"):
        (tmp_path / names).mkdir()
        hierarchies.append(Mounted(tmp_path / names, tmp_path / names, frozenset(names.split(","))))
    made = Version1.open(hierarchies, "nondum-x")
    assert made is not None
    made.make("lamp.1")
    (tmp_path / "memory/nondum-x/lamp.1/memory.limit_in_bytes").write_text("")
    (tmp_path / "cpu,cpuacct/nondum-x/lamp.1/cpu.shares").write_text("")
    made.limit("lamp.1", CgroupLimits(memory_mb=1, cpu_weight=200))
    read = (tmp_path / "memory/nondum-x/lamp.1/memory.limit_in_bytes").read_text()
    assert read == str(1 << 20)
    assert (tmp_path / "cpu,cpuacct/nondum-x/lamp.1/cpu.shares").read_text() == "2048"
    assert made.usage("gone.1").tasks == 0


def test_cgroup_that_cannot_be_limited_is_not_left(tmp_path: Path) -> None:
    cgroups = Cgroups(found := Version2(tmp_path, frozenset({"memory"})))
    with descriptors_left(0), pytest.raises(OSError) as failed:
        cgroups.make("lamp", CgroupLimits())
    assert failed.value.errno == errno.EMFILE
    assert found.names() == ()


class Unkillable(NoTree):
    """Has no descriptor left to kill by; `is_empty` tells whether that matters."""

    def __init__(self, *, is_empty: bool) -> None:
        self._is_empty = is_empty

    def kill(self, name: str) -> None:
        """Fail."""
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    def remove(self, name: str) -> bool:
        """Only an empty one can be removed."""
        return self._is_empty


def test_empty_cgroup_is_removed_although_no_process_can_be_killed() -> None:
    assert Cgroup(Unkillable(is_empty=True), "lamp.1").end()


def test_cgroup_in_which_no_process_can_be_killed_says_why_it_is_left() -> None:
    with pytest.raises(OSError) as failed:
        Cgroup(Unkillable(is_empty=False), "lamp.1").end()
    assert failed.value.errno == errno.EMFILE


def test_cgroup_of_version_1_that_is_made_in_part_is_not_left(tmp_path: Path) -> None:
    found = Version1({"memory": tmp_path / "memory", "pids": tmp_path / "pids"})
    (tmp_path / "memory").mkdir()
    with pytest.raises(FileNotFoundError, match="pids"):
        Cgroups(found).make("lamp", CgroupLimits())
    assert found.names() == ()


@pytest.mark.parametrize(
    ("mountinfo", "cgroup", "own"),
    [
        pytest.param(
            "30 24 0:26 / /sys/fs/cgroup rw,nosuid - cgroup2 cgroup2 rw",
            "0::/system.slice/nondum.service",
            "/sys/fs/cgroup/system.slice/nondum.service",
            id="service",
        ),
        pytest.param(
            "30 24 0:26 /docker/ab /sys/fs/cgroup ro - cgroup2 cgroup2 rw",
            "0::/docker/ab/x",
            "/sys/fs/cgroup/x",
            id="container that sees its part",
        ),
        pytest.param(
            "30 24 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw",
            "0::/../elsewhere",
            "/sys/fs/cgroup",
            id="out of its namespace",
        ),
        pytest.param(
            r"30 24 0:26 / /my\040cgroups rw - cgroup2 cgroup2 rw",
            "0::/",
            "/my cgroups",
            id="blank",
        ),
    ],
)
def test_own_cgroup_is_found(mountinfo: str, cgroup: str, own: str) -> None:
    (found,) = mounted(mountinfo, cgroup)
    assert str(found.own) == own


def test_controllers_that_share_a_hierarchy_are_one() -> None:
    mountinfo = (
        "31 24 0:27 / /sys/fs/cgroup/cpu,cpuacct rw - cgroup cgroup rw,cpu,cpuacct\n"
        "32 24 0:28 / /sys/fs/cgroup/systemd rw - cgroup cgroup rw,xattr,name=systemd\n"
        "33 24 0:29 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n"
    )
    found = mounted(mountinfo, "4:cpu,cpuacct:/a\n2:name=systemd:/b\n0::/c\n")
    assert [sorted(hierarchy.controllers) for hierarchy in found] == [
        ["cpu", "cpuacct"],
        ["name=systemd"],
        [],
    ]
