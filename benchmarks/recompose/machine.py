"""The machine that was measured on, in words."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Iterator
from pathlib import Path


def describe(folder: Path) -> Iterator[str]:
    """Processors, system, and the file system of a folder."""
    release = platform.release().partition("-")[0]
    yield f"{os.cpu_count()} × {platform.machine()}"
    yield f"Linux {release}; {_system()}; Python {platform.python_version()}"
    yield f"drive, store and images on {_file_system(folder)}"


def _system() -> str:
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except OSError:
        return "an unknown distribution"


def _file_system(folder: Path) -> str:
    shown = subprocess.run(
        ["findmnt", "--noheadings", "--output", "FSTYPE", "--target", folder],
        capture_output=True,
        text=True,
        check=False,
    )
    return shown.stdout.strip() or "an unknown file system"
