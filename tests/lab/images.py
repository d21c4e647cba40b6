"""Images of drives as people have them: file systems, labels, partition tables; nothing is mounted.

Loop devices and mount(2) need a kernel that has them: what is here needs neither, and no root.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests.lab import exfat
from tests.lab.cache import call
from tests.lab.drives import MEGABYTE

FILE_SYSTEMS = ("vfat", "exfat", "ext4")
"""Those that drives may have."""
ODD_LABELS = {"vfat": "$(reboot)&", "exfat": "Stöck ☂ ½", "ext4": "../../etc\\x0a"}
"""Labels that are no good names, file system by file system."""
PARTITION_MB = 16
START_MB = 1
LITTER = (
    ".DS_Store",
    "._nondum",
    ".Spotlight-V100/Store-V2/x/tmp.spotlight.state",
    ".Trashes/501/._old",
    ".fseventsd/fseventsd-uuid",
    "System Volume Information/IndexerVolumeGuid",
    "System Volume Information/WPSettings.dat",
    "$RECYCLE.BIN/S-1-5-21/desktop.ini",
    "desktop.ini",
    "Thumbs.db",
    "autorun.inf",
    "LOST.DIR/17",
    "FOUND.000/FILE0000.CHK",
    "nondum/.DS_Store",
    "nondum/._org.example.talker",
    "nondum/desktop.ini",
)
"""What macOS, Windows and Android leave on sticks."""
LITTER_IN_PAYLOAD = (".DS_Store", "._CONTENTS", "desktop.ini", "wheels/._wheel.whl", "Thumbs.db")


def with_litter(content: Path) -> Path:
    """Have a stick's folder littered, and each payload folder in it."""
    payloads = [folder for folder in (content / "nondum").glob("*") if folder.is_dir()]
    places = [content / path for path in LITTER]
    places += [payload / path for payload in payloads for path in LITTER_IN_PAYLOAD]
    for place in places:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(b"\0\5\26\7litter")
    return content


def file_system(
    image: Path, kind: str, content: Path | None = None, *, label: str = "", size_mb: int = 0
) -> Path:
    """Write an image that is one file system with what is in a folder (None: nothing)."""
    _blank(image, size_mb or PARTITION_MB)
    match kind:
        case "vfat":
            call("mkfs.vfat", *(("-n", label) if label else ()), image)
            if content is not None:
                call("mcopy", "-i", image, "-s", *sorted(content.iterdir()), "::")
        case "exfat":
            unicode = {"LC_ALL": "C.UTF-8"}
            call("mkfs.exfat", *(("-L", label) if label else ()), image, env=unicode)
            if content is not None:
                exfat.fill(image, content)
        case "ext4":
            filled = ("-d", content) if content is not None else ()
            call("mkfs.ext4", "-q", "-F", *(("-L", label) if label else ()), *filled, image)
        case "swap":
            call("mkswap", *(("-L", label) if label else ()), image)
        case _:
            raise ValueError(f"no file system that is made here: {kind}")
    return image


def blank(image: Path, size_mb: int = PARTITION_MB) -> Path:
    """Write an image of nothing."""
    _blank(image, size_mb)
    return image


def partitioned(image: Path, table: str, parts: Sequence[Path | None]) -> Path:
    """Write an image with a partition table (`dos` or `gpt`) and a partition of each image, one
    after the other; None is a blank one."""
    sizes = [-(-part.stat().st_size // MEGABYTE) if part else PARTITION_MB for part in parts]
    _blank(image, START_MB + sum(sizes) + START_MB)  # gpt has a second table at the end
    script, at = f"label: {table}\n", START_MB
    for size, part in zip(sizes, parts, strict=True):
        script += f"start={at}MiB, size={size}MiB\n"
        if part is not None:
            with part.open("rb") as source, image.open("r+b") as disk:
                disk.seek(at * MEGABYTE)
                shutil.copyfileobj(source, disk, MEGABYTE)
        at += size
    command = ("sfdisk", "--quiet", "--no-reread", "--no-tell-kernel", "--wipe=never", str(image))
    subprocess.run(command, input=script, text=True, check=True, capture_output=True)
    return image


def _blank(image: Path, size_mb: int) -> None:
    image.parent.mkdir(parents=True, exist_ok=True)
    with image.open("wb") as file:
        os.truncate(file.fileno(), size_mb * MEGABYTE)
