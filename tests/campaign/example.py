"""A small checkout with a campaign, for the tests of campaigns."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

from tests.campaign.registry import CAMPAIGNS

FAULTS = replace(CAMPAIGNS["faults"], module="work")
"""The campaign `faults`, whose command is the checkout's own `work.py`."""


class Checkout:
    """A repository of git with two covered paths and one that is not covered."""

    def __init__(self, root: Path) -> None:
        self.root = root
        root.mkdir()
        self.git("init", "-q", "-b", "main")
        for name in ("a/one.py", "plugin/pyproject.toml", "docs/page.md"):
            self.write(name, "first")
        self.first = self.commit()

    def git(self, *words: str) -> str:
        person = ("-c", "user.name=somebody", "-c", "user.email=somebody@example.org")
        command = ["git", *person, *words]
        done = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
        return done.stdout.strip()

    def write(self, name: str, text: str) -> None:
        file = self.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def commit(self) -> str:
        self.git("add", "-A")
        self.git("commit", "-q", "--allow-empty", "-m", "work")
        return self.git("rev-parse", "--short", "HEAD")
