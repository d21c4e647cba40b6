"""How large the sources are: lines by folder, and the sizes of modules and functions."""

from __future__ import annotations

import ast
import statistics
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[3]
FOLDERS = ("host", "planning", "transport", "wheelhouse", "plugins")
LONGEST = 10
"""Functions that are shown."""


@dataclass(frozen=True, slots=True)
class Function:
    """One function."""

    name: str
    """`path:line name`."""
    lines: int


def modules(root: Path = ROOT) -> Iterator[Path]:
    """The modules that are counted: those of the repository, without tests and the template."""
    listed = subprocess.run(
        ["git", "ls-files", "--", *(f"{folder}/**.py" for folder in FOLDERS)],
        cwd=root,
        capture_output=True,
        text=True,
        check=True,
    )
    for name in listed.stdout.split():
        path = root / name
        if not {"tests", "template"} & set(Path(name).parts) and path.is_file():
            yield path


def functions(path: Path, root: Path = ROOT) -> Iterator[Function]:
    """The functions of a module, from `def` to the last line."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            assert node.end_lineno is not None  # read from text
            name = f"{path.relative_to(root)}:{node.lineno} {node.name}"
            yield Function(name, node.end_lineno - node.lineno + 1)


def main() -> int:
    """Print the figures."""
    paths = list(modules())
    sizes = {path: path.read_text(encoding="utf-8").count("\n") for path in paths}
    for folder in FOLDERS:
        below = [n for path, n in sizes.items() if path.relative_to(ROOT).parts[0] == folder]
        sys.stdout.write(f"{folder:11} {sum(below):7,} lines  {len(below):4} modules\n")
    found = sorted((f for path in paths for f in functions(path)), key=lambda f: -f.lines)
    sys.stdout.write(
        f"{'together':11} {sum(sizes.values()):7,} lines  {len(sizes):4} modules\n"
        f"module median {statistics.median(sizes.values()):g} lines, function median "
        f"{statistics.median(f.lines for f in found):g}; functions above 40 lines: "
        f"{sum(f.lines > 40 for f in found)}, above 80: {sum(f.lines > 80 for f in found)}\n"
    )
    for function in found[:LONGEST]:
        sys.stdout.write(f"{function.lines:5}  {function.name}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
