"""The `nondum` command: one group, each command loaded only when it is called."""

from nondum.cli.main import main

__all__ = ["main"]
