"""Payload drives for the demonstration, built from plugin folders by `nondum payload build`."""

from __future__ import annotations

import contextlib
import hashlib
import platform
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from demo.maker import Maker
from demo.robot import nondum

PYTHON = f"{sys.version_info.major}.{sys.version_info.minor}"


@dataclass(frozen=True, slots=True)
class Target:
    """What payloads are built for; the machine that builds them is always among it, since plugins
    are asked there what they can do."""

    pythons: tuple[str, ...] = ()
    """Beside this one's."""
    architectures: tuple[str, ...] = ()
    """Beside this one."""

    @property
    def options(self) -> list[str]:
        """Of `nondum payload build`."""
        pythons = sorted({PYTHON, *self.pythons})
        architectures = sorted({platform.machine(), *self.architectures})
        given = [("--python", python) for python in pythons]
        given += [("--arch", architecture) for architecture in architectures]
        return [word for option in given for word in option]


HERE = Target()


def build(
    plugins: Sequence[Path],
    *,
    libraries: Sequence[Path],
    cache: Path,
    maker: Maker | None = None,
    target: Target = HERE,
) -> dict[str, Path]:
    """Build one drive per plugin folder, or take it from the cache while its sources are the same.

    `libraries` are folders of distributions that plugins depend on and no index has; `maker` signs,
    if there is one; `target` is where its payloads are to run. Returns the drive of each plugin by
    the folder's name.
    """
    drives = {}
    for plugin in plugins:
        digest = _digest([plugin, *libraries], maker, target)
        drive = cache / f"{plugin.name}-{digest[:12]}"
        if not drive.exists():
            cache.mkdir(parents=True, exist_ok=True)
            unfinished = Path(tempfile.mkdtemp(dir=cache, prefix=f".{plugin.name}-")) / "drive"
            command: list[str | Path] = [
                "payload",
                "build",
                plugin,
                "-o",
                unfinished,
                *target.options,
            ]
            for library in libraries:
                command += ["--library", library]
            if maker is not None:
                command += ["--sign", maker.key]
            nondum(*command, "--quiet")
            with contextlib.suppress(OSError):  # another run has just built the same
                unfinished.rename(drive)
            shutil.rmtree(unfinished.parent, ignore_errors=True)
        drives[plugin.name] = drive
    return drives


def payload_id(drive: Path) -> str:
    """The id of the one payload on a drive: its folder is named for it."""
    (payload,) = (drive / "nondum").iterdir()
    return payload.name


def _digest(folders: Sequence[Path], maker: Maker | None, target: Target) -> str:
    total = hashlib.sha256(" ".join(target.options).encode())
    total.update(maker.public if maker is not None else b"")
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            inside = path.relative_to(folder)
            if path.is_file() and not _is_left_out(inside):
                total.update(str(inside).encode())
                total.update(path.read_bytes())
    return total.hexdigest()


def _is_left_out(path: Path) -> bool:
    """Whether a file has no part in what is built: tests and caches."""
    return any(part.startswith(".") or part in ("__pycache__", "tests") for part in path.parts)
