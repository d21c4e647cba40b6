"""The `nondum` command: one group, each command loaded only when it is called."""

from __future__ import annotations

import sys

from nondum.cli.stop_first import ask_to_stop

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit, as `nondum.cli.root.run` says."""
    words = sys.argv[1:] if arguments is None else arguments
    asked = ask_to_stop() if words == ["stop"] else None
    from nondum.cli.root import run

    run(words, asked)
