"""USB disks that fstab or a unit names stay untouched, beside a stick that works."""

from __future__ import annotations

import json
from typing import Any

from tests.daemon.plugins import talker
from tests.lab import images
from tests.lab.followed import Followed
from tests.lab.lab import Lab
from tests.lab.plugins import doer

PAYLOAD = "org.example.talker"
FSTAB = """
LABEL=DATA\\040OF\\040OURS /srv/data ext4 nofail 0 2
LABEL=SPARE none swap nofail 0 0
"""
UNIT = """
[Mount]
What=/dev/disk/by-label/KEPT
Where=/srv/kept
"""
"""No unit wants it: it is not mounted."""
OWN = ("data", "blank", "swap", "kept")
"""What of it could be plugged in: two partitions, and two disks without any."""
DISKS = 1
"""What of it holds partitions."""


def run(lab: Lab) -> str:
    """Boot with both, plug a stick in beside them, and one that somebody has mounted."""
    machine = lab.booted()
    folder = lab.folder()
    bait = lab.payload("bait", doer("bait", "pass"))
    data = images.file_system(folder / "data.img", "ext4", bait, label="DATA OF OURS")
    disk = images.partitioned(folder / "disk.img", "gpt", [data, None])
    swap = images.file_system(folder / "swap.img", "swap", label="SPARE")
    kept = images.file_system(folder / "kept.img", "ext4", bait, label="KEPT")
    for image in (disk, swap, kept):
        machine.machine.plug(image)
    machine.machine.run(f"mkdir -p /srv/data; cat >>/etc/fstab <<'END'{FSTAB}END\nsync")
    machine.machine.run(f"cat >/etc/systemd/system/srv-kept.mount <<'END'{UNIT}END\nsync")
    machine.machine.reset()
    host = Followed.follow(machine)
    host.wait_until_started()
    host.machine.until("swap and data", lambda: _in_use(host))
    told = host.until("they are left alone", _left_alone)
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    _see_untouched(host)
    _see_mounted_one_told(lab, host)
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    _see_untouched(host)
    return "; ".join(sorted(told))


def _in_use(host: Followed) -> bool | None:
    seen = host.machine.attempt("mountpoint -q /srv/data && grep -q /dev/sd /proc/swaps")
    return True if seen.status == 0 else None


def _left_alone(view: dict[str, Any]) -> list[str] | None:
    """What people are told of disks that are left alone, once they are."""
    told = [told["text"] for told in view["told"] if "DRIVE_OWN" in told["text"]]
    return told if len(told) == len(OWN) else None


def _see_untouched(host: Followed) -> None:
    """See that they are in use as before, can be written to, are no drives, and were not read."""
    assert _in_use(host)
    host.machine.run("echo well >/srv/data/letter && sync && rm /srv/data/letter")
    host.machine.run("cat /sys/class/block/sd*/ro | sort | uniq -c")
    view = host.until("a status", lambda view: view)
    assert "bait" not in str(view), view["payloads"]
    disks = json.loads(host.machine.run("nondum doctor disks --json"))
    own = [disk for disk in disks if disk["usb"] and disk["whose"] == "host"]
    assert len(own) == len(OWN) + DISKS, disks


def _see_mounted_one_told(lab: Lab, host: Followed) -> None:
    """One that somebody mounts before the host comes to it."""
    content = lab.payload("seen", doer("seen", "pass"))
    image = images.file_system(content.parent / "seen.img", "vfat", content, label="SEEN")
    host.stop()
    name = host.machine.plug(image)
    node = host.machine.until("a node", lambda: _labelled(host, "SEEN"))
    host.machine.run(f"mkdir -p /mnt/look && mount {node} /mnt/look")
    host.start()
    host.until("DRIVE_MOUNTED", lambda view: True if "DRIVE_MOUNTED" in str(view) else None)
    host.machine.run("touch /mnt/look/well && umount /mnt/look")
    host.machine.pull(name)


def _labelled(host: Followed, label: str) -> str | None:
    """The node of the file system with a label, once udev has told all about it."""
    seen = host.machine.attempt(f"udevadm settle && readlink -f /dev/disk/by-label/{label}")
    node = seen.out.strip()
    return node if seen.status == 0 and node.startswith("/dev/sd") else None
