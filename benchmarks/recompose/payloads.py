"""The two payloads, built onto drives as any author would build them."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from nondum.wheelhouse.build import build
from nondum.wheelhouse.format.target import Target

HERE = Path(__file__).parent
SDK = HERE.parent.parent / "plugins/sdk"
CONTENT = {
    "small": "plugin, nondum-sdk, msgpack, pluggy, pyserial, pyzmq",
    "big": "the small one's libraries, numpy, opencv-python-headless",
}


@dataclass(frozen=True, slots=True)
class Carried:
    """A payload, and the drive that holds it alone."""

    name: str
    drive: Path
    folder: Path

    @property
    def component(self) -> str:
        """Its one component, also the name of the distribution."""
        return f"bench-{self.name}"

    @property
    def module(self) -> str:
        """The plugin's entry point."""
        return f"bench_{self.name}"

    @property
    def goal(self) -> str:
        """Words that it can be asked for by."""
        return f"weigh the {self.name} payload"

    @property
    def wheels(self) -> tuple[Path, ...]:
        """For this machine only, as the image is."""
        return tuple(sorted(self.folder.glob("wheels/*.whl")))

    @property
    def bytes(self) -> int:
        """All that must be on the drive."""
        return sum(path.stat().st_size for path in self.folder.rglob("*") if path.is_file())

    @property
    def digest(self) -> str:
        """Of its wheels; other builds of the same wheels have the same."""
        total = hashlib.sha256()
        for path in self.wheels:
            total.update(path.read_bytes())
        return total.hexdigest()[:12]


def built(names: Iterable[str], work: Path) -> Iterator[Carried]:
    """Build them. Raises `NondumError`."""
    for name in names:
        drive = work / f"drive-{name}"
        shutil.rmtree(drive, ignore_errors=True)
        options = build.Options(targets=(Target.here(),), libraries=(SDK,))
        folder = build.build(HERE / "plugins" / name, drive, options, lambda *_: None)
        yield Carried(name, drive, folder)


def prepared(names: Iterable[str], work: Path) -> Iterator[Carried]:
    """Those that were built in that folder, wherever it was then."""
    for name in names:
        (folder,) = (work / f"drive-{name}/nondum").iterdir()
        yield Carried(name, work / f"drive-{name}", folder)
