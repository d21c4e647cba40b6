"""Loop devices: block devices on image files, for tests. They need root.

The kernel gives a node that is free to the next process, which may be another test: at its end, a
test acts on a node only if the node is still on its own image.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def can_be_made() -> bool:
    """Whether this machine lets tests have them."""
    return os.geteuid() == 0 and Path("/dev/loop-control").exists()


def attach(image: Path) -> Path:
    """A device on an image, which may have partitions."""
    command = ["losetup", "--find", "--show", "--partscan", str(image)]
    return Path(subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip())


def detach(node: Path) -> None:
    """Take a device away that is one's own. As long as it is mounted, it stays until it is not."""
    # A stick that is pulled takes along that it was read-only; a loop device is used again.
    for command in (["blockdev", "--setrw"], ["losetup", "--detach"]):
        subprocess.run([*command, str(node)], check=True, capture_output=True)


def is_on(node: Path, image: Path) -> bool:
    """Whether a device is on that image, and not on another one by now."""
    try:
        backing = Path(f"/sys/block/{node.name}/loop/backing_file").read_text()
    except FileNotFoundError:
        return False
    return backing.strip().removesuffix(" (deleted)") == str(image)


@contextmanager
def attached(image: Path) -> Iterator[Path]:
    """A device on an image."""
    node = attach(image)
    try:
        yield node
    finally:
        if is_on(node, image):
            detach(node)


def cut_off(image: Path, to_bytes: int) -> None:
    """What lies behind gives EIO from now on, as a pulled stick does."""
    os.truncate(image, to_bytes)
    Path("/proc/sys/vm/drop_caches").write_text("1")
