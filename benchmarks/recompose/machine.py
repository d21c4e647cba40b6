"""The machine that was measured on, in words."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Iterator
from pathlib import Path


def describe(folder: Path) -> Iterator[str]:
    """Processor, memory, system, and the file system of a folder."""
    yield f"{os.cpu_count()} × {_field(Path('/proc/cpuinfo'), 'model name')}, {platform.machine()}"
    memory_kib = int(_field(Path("/proc/meminfo"), "MemTotal").split()[0])
    yield f"{memory_kib * 1024 / 1e9:.0f} GB of memory"
    yield f"Linux {platform.release()}; {_system()}; Python {platform.python_version()}"
    yield f"drive, store and images on {_file_system(folder)}"


def _field(path: Path, name: str) -> str:
    for line in path.read_text(encoding="utf-8").splitlines():
        key, _, value = line.partition(":")
        if key.strip() == name:
            return value.strip()
    return f"unknown {name}"


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
