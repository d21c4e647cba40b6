"""How everything in a worker's sandbox is mounted."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from tests.kit.workers import WorkersUnderTest
from tests.sandbox.guests import does, guest, open_folder

from nondum.host.sandbox.inside import kernel, mounts
from nondum.host.sandbox.levels import bubblewrap
from nondum.host.sandbox.levels.bubblewrap import SEALED

pytestmark = pytest.mark.anyio

MOUNTS = {
    "/": "ro nosuid nodev",
    "/usr": "ro nosuid nodev",
    "/tmp": "rw nosuid nodev size=65536k",
    "/dev": "ro nosuid nodev",
    "/dev/shm": "rw nosuid nodev noexec size=65536k",
    mounts.DEVICES: "ro nosuid nodev noexec size=64k mode=755",
    "code": "ro nosuid nodev",
    "scratch": "rw nosuid nodev",
    **{place: "ro nosuid nodev noexec" for place in SEALED if Path(place).exists()},
}
"""What is mounted in a sandbox, and how."""
OF_THE_KERNEL = {"proc", "tmpfs", "devtmpfs", "devpts"}


async def test_mounts_of_a_sandbox(tested: WorkersUnderTest) -> None:
    await guest(tested, "shutil.copy('/proc/self/mountinfo', 'mounts')")
    assert await does(tested) == ""
    (spec,) = tested.folder.glob("guest")
    names = {"code": str(spec / "site-packages"), "scratch": str(spec / "scratch")}
    found = mounted((spec / "scratch/mounts").read_text(encoding="utf-8"))
    for place, flags in MOUNTS.items():
        mount = found[names.get(place, place)]
        assert mount.flags >= set(flags.split()), place
    assert not [place for place in found if place.startswith(bubblewrap.OUTSIDE)]
    assert "shared" not in found[mounts.DEVICES].propagation
    writable = {place for place, mount in found.items() if mount.is_disk and "rw" in mount.flags}
    assert writable == {names["scratch"]}


@dataclass(frozen=True)
class Mount:
    flags: frozenset[str]
    """Its own, and those of its file system."""
    propagation: frozenset[str]
    is_disk: bool


def mounted(text: str) -> dict[str, Mount]:
    """The last mount at each place (proc_pid_mountinfo(5))."""
    found = {}
    for line in text.splitlines():
        before, after = line.split(" - ")
        _, _, _, _, place, options, *marks = before.split()
        kind, _, more = after.split()
        propagation = frozenset(mark.partition(":")[0] for mark in marks)
        flags = frozenset((*options.split(","), *more.split(",")[1:]))
        found[place] = Mount(
            flags, propagation, kind not in {"proc", "tmpfs", "devtmpfs", "devpts"}
        )
    return found


KEEPS_FLAGS = """
import os, sys
from nondum.host.sandbox.inside import kernel, mounts

flag, folder, how = int(sys.argv[1]), sys.argv[2], sys.argv[3]
kernel.unshare(kernel.CLONE_NEWNS)
kernel.mount(None, "/", None, kernel.MS_SLAVE | 1 << 14)  # MS_REC
for at in (folder, "/dev"):
    kernel.mount("tmpfs", at, "tmpfs", 0)
kernel.mount(None, folder, None, kernel.MS_BIND | kernel.MS_REMOUNT | flag)
os.mkdir(mounts.DEVICES)
kernel.mount("tmpfs", mounts.DEVICES, "tmpfs", 0)
given = dict(outside="", seen_outside=[], hides_outside=True, changes_user=False, user=None)
if how == "bound":
    mounts.bind(folder, folder)
else:
    mounts.pivot({**given, "sealed": [], "protected": [], how: [folder]})
print(os.statvfs(folder).f_flag)
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to mount")
@pytest.mark.parametrize("flag", ["RDONLY", "NOSUID", "NODEV", "NOEXEC"])
@pytest.mark.parametrize("how", ["sealed", "protected", "bound"])
def test_folder_keeps_the_flags_of_its_mount(flag: str, how: str) -> None:
    bit: int = getattr(kernel, f"MS_{flag}")
    with open_folder() as folder:
        said = subprocess.run(
            [sys.executable, "-c", KEEPS_FLAGS, str(bit), str(folder), how],
            capture_output=True,
            text=True,
            check=True,
        )
    assert int(said.stdout) & bit
    assert how == "bound" or int(said.stdout) & kernel.MS_RDONLY
