r"""Text of strangers as a terminal may be shown it.

What plugins log, and what drives name their files, must not move a cursor or set a title.
"""

from __future__ import annotations

MAX_LINE = 4096
"""Characters that are kept of one line."""


def printable_text(text: str) -> str:
    """Any lines, each made `printable`."""
    return "\n".join(printable(line) for line in text.splitlines())


def printable(text: str) -> str:
    r"""One line for a terminal: what could control it is shown as an escape, and it is not endless.

    >>> printable("done\x1b[2J\n")
    'done\\x1b[2J'
    """
    kept = text.rstrip("\r\n")[:MAX_LINE]
    if kept.isprintable():
        return kept
    shown = (c if c.isprintable() or c == "\t" else c.encode("unicode_escape") for c in kept)
    return "".join(part if isinstance(part, str) else part.decode("ascii") for part in shown)
