"""Words that are not written here, and the names that nothing has: `words.toml`.

python -m tests.words [PATH…]        # lists where they are
"""

from __future__ import annotations

import re
import subprocess
import sys
import tokenize
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILE = Path(__file__).with_suffix(".toml")
TEXT = (
    *(
        ".py",
        ".md",
        ".toml",
        ".json",
        ".sql",
        ".pddl",
        ".sh",
        ".cfg",
        ".ini",
        ".conf",
        ".rules",
        ".1",
    ),
    *(".service", ".socket", "postinst", "postrm", "preinst", "prerm"),
)


@dataclass(frozen=True, slots=True)
class Rules:
    """What `words.toml` says."""

    text: re.Pattern[str]
    """Words that no text has."""
    names: frozenset[str]
    """Words that no name of a module, class, function or configuration key has."""
    spared: tuple[tuple[str, frozenset[str]], ...]
    """Paths (`name/` for a folder) and the words that they may have; none: any."""

    def spares(self, path: str, word: str) -> bool:
        """Whether a file may have a word."""
        return any(
            (path.startswith(place) if place.endswith("/") else path == place)
            and (not words or word.lower() in words)
            for place, words in self.spared
        )


def read(file: Path = FILE) -> Rules:
    """Read the rules."""
    table = tomllib.loads(file.read_text(encoding="utf-8"))
    words = "|".join(table["text"])
    return Rules(
        re.compile(rf"(?<![A-Za-z])(?:{words})(?![A-Za-z])", re.IGNORECASE),
        frozenset(table["names"]),
        tuple((row["path"], frozenset(row.get("words", ()))) for row in table["spared"]),
    )


def files(root: Path = ROOT) -> Iterator[str]:
    """All files of text that the repository has."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    return (n for n in listed.stdout.splitlines() if n.endswith(TEXT) and (root / n).is_file())


def in_text(rules: Rules, path: str, text: str) -> Iterator[str]:
    """Each place of a word that is not written: `path:line: word`."""
    for number, line in enumerate(text.splitlines(), start=1):
        for found in rules.text.finditer(line):
            if not rules.spares(path, found.group()):
                yield f"{path}:{number}: {found.group()}"


def in_names(rules: Rules, path: str, names: Iterable[tuple[int, str]]) -> Iterator[str]:
    """Each name with a word that names do not have: `path:line: name`."""
    for number, name in names:
        parts = {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
        for word in sorted(parts & rules.names):
            if not rules.spares(path, word):
                yield f"{path}:{number}: {name}"


def names_of(path: Path) -> Iterator[tuple[int, str]]:
    """The names that a module gives: its own, those of classes and of functions."""
    yield 0, path.stem
    with path.open("rb") as file:
        tokens = list(tokenize.tokenize(file.readline))
    for before, token in pairwise(tokens):
        if before.string in {"class", "def"} and before.type == tokenize.NAME:
            yield token.start[0], token.string


def main(paths: Iterable[str]) -> int:
    """List the places below `paths`, all of them without any."""
    rules, wanted = read(), tuple(paths)
    found: list[str] = []
    for name in files():
        if not wanted or name.startswith(wanted):
            path = ROOT / name
            found += in_text(rules, name, path.read_text(encoding="utf-8"))
            if name.endswith(".py") and "/template/" not in name:
                found += in_names(rules, name, names_of(path))
    sys.stdout.write("".join(f"{place}\n" for place in found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
