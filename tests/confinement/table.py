"""Writes what a hostile plugin reaches at each level into docs/confinement.md.

    python -m tests.confinement.table [--of-level-2 FILE]

Levels that this machine does not have come from a file that `--json` wrote on one that has.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from tests.confinement.baits import attempted, laid
from tests.confinement.escape import ATTEMPTS

from nondum.host.workers.confinements import Boxed, Confinement, Held, Unconfined

PAGE = Path(__file__).parents[2] / "docs/confinement.md"
BEGIN, END = "<!-- attempts -->", "<!-- /attempts -->"
Column = Mapping[str, bool]


def main() -> None:
    """Try everything and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the results there, and no page")
    parser.add_argument("--of-level-2", type=Path, help="such a file, of a machine with systemd")
    options = parser.parse_args()
    columns = asyncio.run(tried())
    if options.json:
        options.json.write_text(json.dumps(columns, indent=1), encoding="utf-8")
        return
    if options.of_level_2:
        columns["2"] = json.loads(options.of_level_2.read_text(encoding="utf-8"))["2"]
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(f"{before}{BEGIN}\n{table(columns)}\n{END}{after}", encoding="utf-8")


async def tried() -> dict[str, Column]:
    """Level → attempt → whether it succeeded."""
    return {level: await column(confinement) for level, confinement in levels().items()}


def levels() -> dict[str, Confinement]:
    """The levels that need no service manager."""
    return {"0": Unconfined(), "1": Held(), "3": Boxed(shutil.which("bwrap") or "bwrap")}


async def column(confinement: Confinement) -> Column:
    """What is reached in one confinement."""
    with tempfile.TemporaryDirectory() as folder, laid(Path(folder)) as bait:
        results = await attempted(Path(folder), bait, confinement)
    return {name: result.could for name, result in results.items()}


def table(columns: Mapping[str, Column]) -> str:
    """As Markdown; `–`: held, `yes`: it succeeded."""
    names = sorted(columns)
    lines = [f"| it tries to | {' | '.join(f'level {name}' for name in names)} |"]
    lines.append(f"|---|{'---|' * len(names)}")
    for attempt in ATTEMPTS:
        cells = (_cell(columns[name].get(attempt)) for name in names)
        lines.append(f"| {attempt} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(could: bool | None) -> str:
    return "?" if could is None else "yes" if could else "–"


if __name__ == "__main__":
    main()
