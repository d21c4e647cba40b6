"""The same payload as a container image: the smallest Debian that runs it, and its wheels.

All choices favour the container: no package manager, documentation or translations, one layer, one
architecture, and everything compiled to bytecode beforehand.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.recompose.podman import READY, Podman

SUITE = "bookworm"
PYTHON = (3, 11)
"""Of that suite; the wheels must be for it."""
PACKAGES = ("python3", "libstdc++6")
_LEFT_OUT = ("doc/*", "man/*", "locale/*", "info/*", "lintian/*")
_SITE = "opt/site-packages"
_PROGRAM = f"""\
import signal, sys
sys.path.append("/{_SITE}")
from nondum.sdk import worker  # what serves the host, as in a venv
from nondum.sdk.plugin import describe, load
describe(load(*sys.argv[1:]))
sys.stdout.write({READY.decode()!r})
sys.stdout.flush()
signal.pause()
"""


@dataclass(frozen=True, slots=True)
class Image:
    """An image as files, as a person would carry it on a drive."""

    name: str
    tar: Path
    packed: Path
    """The same, compressed by gzip -6."""


def build(
    name: str, module: str, distribution: str, wheels: Sequence[Path], work: Path, podman: Podman
) -> Image:
    """Build an image, or take it from `work` where it was built before."""
    image = Image(f"localhost/{name}", work / f"{name}.tar", work / f"{name}.tar.gz")
    if image.packed.exists():
        return image
    rootfs = work / f"{name}-rootfs"
    shutil.rmtree(rootfs, ignore_errors=True)
    try:
        _debian(rootfs)
        _payload(rootfs, wheels)
        command = ("python3", "-I", "-S", "/opt/main.py", module, distribution)
        podman.make_image(rootfs, command, image.name, image.tar)
    finally:
        shutil.rmtree(rootfs, ignore_errors=True)
    unfinished = image.packed.with_suffix(".part")
    with unfinished.open("wb") as out:
        subprocess.run(["gzip", "-6", "--stdout", image.tar], stdout=out, check=True)
    unfinished.rename(image.packed)
    return image


def _debian(rootfs: Path) -> None:
    subprocess.run(
        [
            *("mmdebstrap", "--quiet", "--variant=extract", f"--include={','.join(PACKAGES)}"),
            *(f"--dpkgopt=path-exclude=/usr/share/{part}" for part in _LEFT_OUT),
            *(SUITE, str(rootfs)),
        ],
        check=True,
    )


def _payload(rootfs: Path, wheels: Sequence[Path]) -> None:
    site = rootfs / _SITE
    subprocess.run(
        [
            *(sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps"),
            *("--no-compile", "--target", str(site), *map(str, wheels)),
        ],
        check=True,
    )
    (rootfs / "opt/main.py").write_text(_PROGRAM, encoding="utf-8")
    folders = (f"/usr/lib/python{PYTHON[0]}.{PYTHON[1]}", f"/{_SITE}")
    compiling = ["chroot", str(rootfs), "python3", "-I", "-m", "compileall", "-q", *folders]
    subprocess.run(compiling, check=False)  # some libraries carry files for other Pythons
