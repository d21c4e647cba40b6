"""How well goals in a person's own words are understood: `python -m benchmarks.language`."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from benchmarks.language import corpus
from benchmarks.language.corpus import Sentence
from benchmarks.language.scoring import Score, judged, scored
from benchmarks.language.understanding import Declared, Nearly, Rung, WordOverlap, robot

PAGE = Path(__file__).parents[2] / "docs/benchmarks/language.md"
METHOD = Path(__file__).with_name("method.md")


def main() -> None:
    """Ask every rung, print the tables, and write the page."""
    chosen = _arguments()
    to = robot()
    rungs: tuple[Rung, ...] = (Declared(to), Nearly(to), WordOverlap(to))
    every = corpus.sentences()
    if chosen.show:
        print("\n".join(_shown(rungs, every)))
        return
    parts = [METHOD.read_text(encoding="utf-8")]
    for title, is_kept in (("Kept from tuning", True), ("The others", False)):
        some = [sentence for sentence in every if sentence.is_kept is is_kept]
        parts.append(
            "\n".join((f"## {title}: {len(some)} sentences", "", *_table(rungs, some), ""))
        )
    page = "\n".join(parts)
    chosen.out.write_text(page, encoding="utf-8")
    print(page)


def _table(rungs: Sequence[Rung], sentences: Sequence[Sentence]) -> Iterator[str]:
    """Right, missed and wrong of each group, and of all."""
    yield (
        "| sentences | " + " | ".join(f"{rung.name}: right, missed, wrong" for rung in rungs) + " |"
    )
    yield "|---|" + "---|" * len(rungs)
    groups = list(dict.fromkeys(sentence.group for sentence in sentences))
    for group in groups:
        some = [sentence for sentence in sentences if sentence.group == group]
        yield _row(f"{group} ({len(some)})", (scored(rung, some) for rung in rungs))
    yield _row("**all**", (scored(rung, sentences) for rung in rungs))


def _row(name: str, scores: Iterable[Score]) -> str:
    told = (f"{one.right}, {one.missed}, {one.wrong}" for one in scores)
    return f"| {name} | {' | '.join(told)} |"


def _shown(rungs: Sequence[Rung], sentences: Iterable[Sentence]) -> Iterator[str]:
    """What was not understood as it was meant, of those that are not kept from tuning."""
    for sentence in sentences:
        for rung in rungs:
            understood = rung.meaning(sentence.text)
            if not sentence.is_kept and not judged(sentence.meaning, understood).right:
                told = understood or "nothing"
                yield f"{rung.name}: {sentence.text!r} is {sentence.meaning}, taken for {told}"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.language", description=__doc__)
    parser.add_argument("--out", type=Path, default=PAGE, help="the page [default: %(default)s]")
    parser.add_argument("--show", action="store_true", help="print what was misunderstood instead")
    return parser.parse_args()


if __name__ == "__main__":
    main()
