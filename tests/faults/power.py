"""The power is cut after any write that a host's disk was ever given.

One life of a daemon (installation, upgrade, removals) is recorded; its disk is then brought to
where it was after each of its writes, with and without what had not been flushed yet, mounted as
after a power failure, and a daemon started on it.
"""

from __future__ import annotations

import contextlib
import random
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tests.faults.model import Ended, Told, check
from tests.faults.play import Player
from tests.faults.points import prepare
from tests.faults.recorded_disk import Write, cut, recorded, writes
from tests.faults.ways import newer, sound
from tests.kit.fork_server import Nursery

SIZE_MB = 48
SCRIPT = ("plug a", "plug b", "pull b", "pull a")


@dataclass(frozen=True)
class Life:
    """What a disk was told while a daemon lived on it."""

    folder: Path
    done: tuple[Write, ...]

    @property
    def first(self) -> Path:
        """The disk before."""
        return self.folder / "disk/first"

    @property
    def root(self) -> Path:
        """Where that daemon lived."""
        return self.folder / "host"


def lived(folder: Path) -> Life | None:
    """A life that was recorded there before."""
    log = folder / "disk/log"
    return Life(folder, tuple(writes(log))) if (folder / "host/drives").exists() else None


def live(nursery: Nursery, folder: Path, script: Sequence[str] = SCRIPT) -> Life:
    """Have a daemon live, from its first start to its end."""
    root = folder / "host"
    prepare(root, {"a": sound, "b": newer})
    (folder / "disk").mkdir()
    with recorded(folder / "disk", SIZE_MB, root / "state") as log:
        player = Player(root, script)
        nursery.run({"root": str(root), "log": str(log)}, player.play, expect=0)
        assert not player.stuck
    return Life(folder, tuple(writes(log)))


def cuts(life: Life, count: int, seed: int = 5) -> Iterator[tuple[int, int | None]]:
    """So many ways to cut it short: after how many writes, and the chance (a seed) by which what
    was not flushed is lost; None: all of it is there."""
    chance = random.Random(seed)
    for nth in range(count):
        yield chance.randrange(len(life.done) + 1), None if nth % 3 == 0 else nth


def fail(life: Life, after: int, seed: int | None, folder: Path) -> Ended:
    """Cut the power there; what a daemon made of it that was started with drive `a` plugged in.

    The folder is there for nothing else, and empty.
    """
    image, root = folder / "image", folder / "host"
    shutil.copyfile(life.first, image)
    cut(image, list(life.done[:after]), random.Random(seed) if seed is not None else None)
    (root / "slots").mkdir(parents=True)
    (root / "slots/a").symlink_to(life.root / "drives/a")
    told = Told.of(life.root, life.done[after - 1].end if after else 0)
    with _mounted(image, root / "state"):
        ended = check(root, told)
        wrong = [*ended.wrong, *_unsound(root / "state")]
    return replace(ended, wrong=tuple(wrong))


@contextlib.contextmanager
def _mounted(image: Path, at: Path) -> Iterator[None]:
    at.mkdir(parents=True)
    subprocess.run(["mount", "-o", "loop", str(image), str(at)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(at)], check=True)


def _unsound(state: Path) -> Iterator[str]:
    """What only a power failure leaves behind: files that are there, and empty."""
    for name in ("store", "payloads", "installed", "backups"):
        for path in (state / name).rglob("*"):
            if path.is_file() and not path.stat().st_size and path.suffix in (".json", ".toml"):
                yield f"empty: {path.relative_to(state)}"
