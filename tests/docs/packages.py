"""The picture of the host's packages in ARCHITECTURE.md, drawn from what they import."""

from __future__ import annotations

from pathlib import Path

from tests.kit.packages import imports, reduced

ARCHITECTURE = Path(__file__).parents[2] / "ARCHITECTURE.md"
START = "<!-- Written by `python -m tests.docs.reference`. -->\n"
END = "<!-- Until here. -->\n"


def picture() -> str:
    """A Mermaid graph: an arrow from each package to those that it builds on.

    Arrows that follow from others are left out.
    """
    graph = reduced(imports("nondum.host"))
    arrows = (f"    {name} --> {near}" for name in graph for near in sorted(graph[name]))
    return "\n".join(("```mermaid", "graph BT", *sorted(arrows), "```", ""))


def drawn() -> str:
    """The picture that ARCHITECTURE.md has."""
    return _parts()[1]


def draw() -> None:
    """Put the picture into ARCHITECTURE.md."""
    before, _, after = _parts()
    ARCHITECTURE.write_text(f"{before}{START}{picture()}{END}{after}", encoding="utf-8")


def _parts() -> tuple[str, str, str]:
    before, _, rest = ARCHITECTURE.read_text(encoding="utf-8").partition(START)
    old, _, after = rest.partition(END)
    return before, old, after
