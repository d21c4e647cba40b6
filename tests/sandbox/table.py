"""Writes what a hostile plugin reaches at each level into docs/confinement.md.

python -m tests.sandbox.table
"""

from __future__ import annotations

import asyncio
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from tests.sandbox.baits import attempted, laid
from tests.sandbox.escape import ATTEMPTS

from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.unconfined import Unconfined
from nondum.wheelhouse.format.confinement import Level

PAGE = Path(__file__).parents[2] / "docs/confinement.md"
BEGIN, END = "<!-- attempts -->", "<!-- /attempts -->"
Column = Mapping[str, bool]


def main() -> None:
    """Try everything and write the table."""
    columns = asyncio.run(tried())
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    after = rest.partition(END)[2]
    PAGE.write_text(f"{before}{BEGIN}\n{table(columns)}\n{END}{after}", encoding="utf-8")


async def tried() -> dict[Level, Column]:
    """Level → attempt → whether it succeeded."""
    confinements = (Unconfined(), Held(), Boxed(shutil.which("bwrap") or "bwrap"))
    return {each.level: await column(each) for each in confinements}


async def column(confinement: Confinement) -> Column:
    """What is reached in one confinement."""
    with tempfile.TemporaryDirectory() as folder, laid(Path(folder)) as bait:
        results = await attempted(Path(folder), bait, confinement)
    return {name: result.could for name, result in results.items()}


def table(columns: Mapping[Level, Column]) -> str:
    """As Markdown; `–`: held, `yes`: it succeeded."""
    levels = sorted(columns)
    lines = [f"| it tries to | {' | '.join(map(str, levels))} |"]
    lines.append(f"|---|{'---|' * len(levels)}")
    for attempt in ATTEMPTS:
        cells = ("yes" if columns[level][attempt] else "–" for level in levels)
        lines.append(f"| {attempt} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
