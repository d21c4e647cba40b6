"""The power is cut after any write that a host's disk was ever given.

One life of a daemon (installation, upgrade, removals; trust, peers, notes and backups beside them)
is recorded; its disk is then brought to where it was after each of its writes, with and without
what had not been flushed yet, mounted as after a power failure, and a daemon started on it.
"""

from __future__ import annotations

import bisect
import contextlib
import random
import shutil
import sqlite3
import subprocess
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from tests.faults import kept
from tests.faults.model import Ended, Told, check, look
from tests.faults.play import Player
from tests.faults.points import prepare
from tests.faults.recorded_disk import Write, cut, drop, recorded, writes
from tests.faults.ways import newer, sound
from tests.kit.fork_server import Nursery

SIZE_MB = 48
SCRIPT = ("plug a", "plug b", "pull b", "pull a")
_STORED = ("stored", "probed", "active", "superseded")
"""Steps of payloads whose files are on disk, as it is promised."""
KEEPS = (("ACTIVE", "keep"), ("SUPERSEDED", "keep"))
"""When it keeps what lies beside the catalogue."""


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
        orders = {"root": str(root), "log": str(log), "nudge": [list(one) for one in KEEPS]}
        nursery.run(orders, player.play, expect=0)
        assert not player.stuck
    return Life(folder, tuple(writes(log)))


def cuts(life: Life, count: int, seed: int = 5) -> Iterator[tuple[int, int | None]]:
    """`count` ways to cut it short: after how many writes, and the seed that chooses which of the
    unflushed writes are lost; None: none of them."""
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
    log = life.done[after - 1].end if after else 0
    with _mounted(image, root / "state"):
        lost = list(kept.lost(life.root, root / "state", log))
        ended = check(root, Told.of(life.root, log))
        wrong = [*lost, *ended.wrong, *_unsound(root / "state")]
    return replace(ended, wrong=tuple(wrong))


def promised_after(life: Life) -> Iterator[int]:
    """After how many writes something was promised, each time."""
    ends = [write.end for write in life.done]
    for log in kept.moments(life.root):
        yield bisect.bisect_right(ends, log)


def lost(life: Life, after: int, folder: Path) -> list[str]:
    """What is wrong with a disk of which the power failure took all that was not flushed; no
    daemon is started on it."""
    image, root = folder / "image", folder / "host"
    shutil.copyfile(life.first, image)
    drop(image, list(life.done[:after]))
    log = life.done[after - 1].end if after else 0
    with _mounted(image, root / "state"):
        wrong = [*kept.lost(life.root, root / "state", log), *_unsound(root / "state", _STORED)]
        return [*wrong, *look(root, Told.of(life.root, log))]


@contextlib.contextmanager
def _mounted(image: Path, at: Path) -> Iterator[None]:
    at.mkdir(parents=True)
    subprocess.run(["mount", "-o", "loop", str(image), str(at)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(at)], check=True)


def _unsound(state: Path, steps: Collection[str] = ()) -> Iterator[str]:
    """What only a power failure leaves behind: files that are there, and empty; with `steps`, those
    of payloads at these only, which must be there."""
    stored = _at(state / "catalogue.sqlite", steps)
    for key in stored:
        if not (state / "payloads" / key / "CONTENTS").exists():
            yield f"gone: payloads/{key}"
    folders = [f"payloads/{key}" for key in stored] if steps else ["payloads"]
    for name in ("store", "installed", "backups", *folders):
        for path in (state / name).rglob("*"):
            if path.is_file() and not path.stat().st_size and path.suffix in (".json", ".toml"):
                yield f"empty: {path.relative_to(state)}"


def _at(catalogue: Path, steps: Collection[str]) -> list[str]:
    """Payloads that are at one of these steps."""
    if not steps or not catalogue.exists():
        return []
    with contextlib.closing(sqlite3.connect(catalogue)) as connection:
        try:
            found = connection.execute("SELECT key, step FROM payloads").fetchall()
        except sqlite3.OperationalError:  # its tables are not made yet
            return []
    return [key for key, step in found if step in steps]
