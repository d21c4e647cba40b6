"""Small file systems of different kinds, mounted for a test."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def file_system(folder: Path, size_mb: int, options: str = "loop") -> Iterator[Path]:
    """A real ext4 on a file, mounted; the file is `<folder>.img`."""
    image = folder.with_suffix(".img")
    with image.open("wb") as file:
        file.truncate(size_mb * 1024**2)
    subprocess.run(["mkfs.ext4", "-q", "-O", "^has_journal", image], check=True)
    folder.mkdir()
    subprocess.run(["mount", "-o", options, image, folder], check=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


needs_mount = pytest.mark.skipif(
    os.geteuid() != 0 or sys.platform != "linux", reason="mounting needs root"
)
