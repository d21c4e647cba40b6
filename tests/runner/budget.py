"""How long each folder of tests may take, and how long it took: tests/budget.toml."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.runner import toml_file
from tests.runner.result import Result

FILE = Path(__file__).parents[1] / "budget.toml"
BEYOND = 1.5
"""A folder that takes this many times its budget fails the run."""
SPARE_S = 5.0
"""A folder of a few seconds is not judged by one slow process start."""


@dataclass(frozen=True, slots=True)
class Budget:
    """What the file says."""

    yardstick_s: float
    """`yardstick.measured_s` of the machine on which the seconds were measured."""
    folders: Mapping[str, float]
    """Folder → seconds of all its tests, added up."""
    slow_files: Mapping[str, float]
    """Test files that are started first, since they take longest: → seconds."""

    def folder_of(self, test: str) -> str:
        """The folder whose budget a test counts for: the longest that its path begins with."""
        file = test.split("::", 1)[0]
        known = (name for name in self.folders if file == name or file.startswith(f"{name}/"))
        return max(known, key=len, default=str(Path(file).parent))


@dataclass(frozen=True, slots=True)
class Spent:
    """What a folder took."""

    folder: str
    tests: int
    seconds: float
    budget_s: float | None
    """None: the file has no budget for it."""

    @property
    def is_beyond(self) -> bool:
        """Whether it took so much that the run fails on a machine that can be judged."""
        if self.budget_s is None:
            return True
        return self.seconds > max(self.budget_s * BEYOND, self.budget_s + SPARE_S)


def read(file: Path = FILE) -> Budget:
    """Read the budgets."""
    table = toml_file.load(file)
    return Budget(table["yardstick_s"], table["folders"], table.get("slow_files", {}))


def spent(budget: Budget, results: Iterable[Result], slower: float) -> tuple[Spent, ...]:
    """What each folder took, the dearest first; `slower` says how many times as long as the machine
    of the budgets this one takes, and seconds are told as those of that one."""
    seconds: dict[str, float] = defaultdict(float)
    tests: dict[str, int] = defaultdict(int)
    for result in results:
        folder = budget.folder_of(result.test)
        seconds[folder] += result.seconds
        tests[folder] += 1
    rows = [
        Spent(folder, tests[folder], total / slower, budget.folders.get(folder))
        for folder, total in seconds.items()
    ]
    return tuple(sorted(rows, key=lambda row: -row.seconds))
