"""The command: `python -m benchmarks.peers`, from the root of the checkout; as root where each host
is to have a separate machine (network namespace)."""

from __future__ import annotations

import argparse
import asyncio
import os
import sys
from pathlib import Path

from benchmarks.peers import calls, presence
from benchmarks.peers.ground import ground
from benchmarks.peers.report import Results, as_json, as_markdown

PAGE = Path(__file__).parents[2] / "docs/benchmarks/peers.md"
PARTS = ("presence", "calls")


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=10, help="of everything [10]")
    parser.add_argument("--calls", type=int, default=4000, help="one by one in a repeat [4000]")
    parser.add_argument("--part", choices=PARTS, help="measure this only")
    parser.add_argument("--json", action="store_true", help="print all repeats, write no page")
    parser.add_argument("--out", type=Path, default=PAGE, help="the page to write")
    chosen = parser.parse_args()
    found = measure(chosen.repeats, chosen.calls, [chosen.part] if chosen.part else PARTS)
    if chosen.json:
        print(as_json(found))
        return
    text = as_markdown(found)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    chosen.out.write_text(text, encoding="utf-8")
    print(text)
    print(f"peers: written to {chosen.out}", file=sys.stderr)


def measure(repeats: int, calls_each: int, parts: list[str] | tuple[str, ...]) -> Results:
    """What was asked for."""
    load, *_ = os.getloadavg()
    with ground() as here:
        present = presence.measure(here, repeats) if "presence" in parts else None
    called = asyncio.run(calls.measure(repeats, calls_each)) if "calls" in parts else None
    return Results(repeats, calls_each, load, here, present, called)


if __name__ == "__main__":
    main()
