"""Widely used wheels, fetched and judged: none may be refused but for a start-up hook.

    python -m tests.wheelhouse.popular             # fetches what is not there, judges all
    python -m tests.wheelhouse.popular --judge     # judges those that were fetched before

pip fetches them from whatever index it is set to, each held to its hash in the list
(tests/data/popular-wheels.txt), into a cache outside of the repository, nondum-wheels below
$XDG_CACHE_HOME. The results are written to docs/wheels.md.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from packaging.utils import parse_wheel_filename

from nondum.sdk.errors import Problem
from nondum.wheelhouse.build.locking import sha256
from nondum.wheelhouse.format.target import ARCHITECTURES, Target
from nondum.wheelhouse.wheels import wheel

LIST = Path(__file__).parents[1] / "data/popular-wheels.txt"
CACHE = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "nondum-wheels"
DOCUMENT = Path(__file__).parents[2] / "docs/wheels.md"
MARK = "<!-- What follows is written by `python -m tests.wheelhouse.popular`. -->\n"
PYTHONS = ("3.11", "3.12", "3.13")


@dataclass(frozen=True)
class Popular:
    """A wheel of the list."""

    name: str
    version: str
    filename: str
    sha256: str

    @property
    def path(self) -> Path:
        """Where it is kept."""
        return CACHE / self.filename

    @property
    def target(self) -> Target:
        """A host that takes it."""
        tags = parse_wheel_filename(self.filename)[3]
        fitting = [a for a in ARCHITECTURES if any(t.platform.endswith(a) for t in tags)]
        pythons = [
            p for p in PYTHONS if any(t.interpreter == f"cp{p.replace('.', '')}" for t in tags)
        ]
        return Target(next(iter(fitting), ARCHITECTURES[0]), next(iter(pythons), PYTHONS[0]))

    @property
    def kind(self) -> str:
        """In which row of the table it counts."""
        platforms = {tag.platform for tag in parse_wheel_filename(self.filename)[3]}
        if platforms == {"any"}:
            return "pure"
        return f"native, {self.target.architecture}"


def listed() -> tuple[Popular, ...]:
    """The wheels of the list."""
    rows = (line.split() for line in LIST.read_text(encoding="ascii").splitlines())
    return tuple(Popular(*row) for row in rows if row and row[0] != "#")


def fetch(wheels: Sequence[Popular]) -> None:
    """Fetch what is not there, the wheels of one kind of host at once."""
    CACHE.mkdir(parents=True, exist_ok=True)
    groups = defaultdict(list)
    for popular in wheels:
        if not popular.path.exists():
            groups[popular.target].append(popular)
    for target, missing in groups.items():
        # One distribution may be in the list twice for one kind of host, which pip will not have.
        rest = missing
        while rest:
            batch = list({popular.name: popular for popular in rest}.values())[:40]
            rest = [popular for popular in rest if popular not in batch]
            tell(f"fetching for Python {target.python}, {target.architecture}: {len(batch)}")
            _fetch(target, batch)


def _fetch(target: Target, wheels: Sequence[Popular]) -> None:
    platforms = [part for name in target.platforms() for part in ("--platform", name)]
    with tempfile.NamedTemporaryFile("w", suffix=".txt", encoding="ascii") as wanted:
        for popular in wheels:
            wanted.write(f"{popular.name}=={popular.version} --hash=sha256:{popular.sha256}\n")
        wanted.flush()
        subprocess.run(
            [
                *(sys.executable, "-m", "pip", "download", "-qq", "--no-deps"),
                *("--only-binary", ":all:", "--implementation", "cp", "--require-hashes"),
                *("--python-version", target.python, *platforms),
                *("--dest", str(CACHE), "--requirement", wanted.name),
            ],
            check=True,
        )


def judge(popular: Popular) -> tuple[Problem, ...]:
    """What the host would say of a wheel, its contents included."""
    if sha256(popular.path) != popular.sha256:
        return (Problem("HASH_MISMATCH", "is not the wheel of the list", where=popular.filename),)
    return wheel.check(popular.path)


def judged(wheels: Sequence[Popular]) -> Iterator[tuple[Popular, tuple[Problem, ...]]]:
    """All of them, as they are done."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        found = pool.map(judge, wheels)
        for number, (popular, problems) in enumerate(zip(wheels, found, strict=True), start=1):
            tell(f"{number}/{len(wheels)} {popular.filename[:60]}")
            yield popular, problems


def table(results: Sequence[tuple[Popular, tuple[Problem, ...]]]) -> str:
    """The results, a row a kind of wheel."""
    counts = Counter(popular.kind for popular, _ in results)
    hooks = [p for p, problems in results if _codes(problems) == {"WHEEL_STARTUP_HOOK"}]
    false = [(p, problems) for p, problems in results if problems and p not in hooks]
    names = len({popular.name for popular, _ in results})
    lines = [
        "| wheels | judged | refused for a start-up hook | refused otherwise |",
        "|---|---|---|---|",
    ]
    for kind in sorted(counts):
        told = sum(p.kind == kind for p in hooks), sum(p.kind == kind for p, _ in false)
        lines.append(f"| {kind} | {counts[kind]} | {told[0]} | {told[1]} |")
    size = sum(popular.path.stat().st_size for popular, _ in results) / 1e9
    lines += [
        "",
        f"{len(results)} wheels of {names} distributions, {size:.1f} GB, each unpacked and hashed.",
    ]
    lines += [f"- {popular.filename}: {problems[0]}" for popular, problems in false]
    return "\n".join(lines) + "\n"


def _codes(problems: Sequence[Problem]) -> set[str]:
    return {problem.code for problem in problems}


def tell(text: str) -> None:
    """One line of progress."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()


def main() -> None:
    """Fetch, judge, write the table; exit with 1 on a false refusal."""
    wheels, begun = listed(), time.monotonic()
    if "--judge" not in sys.argv:
        fetch(wheels)
    results = list(judged([popular for popular in wheels if popular.path.exists()]))
    tell("")
    found = table(results)
    sys.stdout.write(f"{found}\n{time.monotonic() - begun:.0f} s\n")
    words = DOCUMENT.read_text(encoding="utf-8").partition(MARK)[0]
    DOCUMENT.write_text(f"{words}{MARK}\n{found}", encoding="utf-8")
    false = any(_codes(problems) - {"WHEEL_STARTUP_HOOK"} for _, problems in results)
    sys.exit(1 if false or len(results) < len(wheels) else 0)


if __name__ == "__main__":
    main()
