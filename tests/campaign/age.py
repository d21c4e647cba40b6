"""How old the last result of each campaign is: what has changed since it passed."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

from tests.campaign import page
from tests.campaign.registry import CAMPAIGNS, Campaign


@dataclass(frozen=True, slots=True)
class Changes:
    """What git says of the time since a commit."""

    commits: int
    """From that commit to the present one."""
    paths: tuple[str, ...]
    """Those that a campaign covers and that differ from the commit in the working tree."""


@dataclass(frozen=True, slots=True)
class Age:
    """How old the last passing result of a campaign is."""

    campaign: str
    passed_at: str
    """Short hash of the commit; empty: it has never passed."""
    commits: int | None
    """Since then; None: it has never passed, or git does not know that commit here."""
    is_current: bool
    """Nothing that it covers has changed since it passed."""
    why: str
    """In a few words."""


def ages(root: Path) -> tuple[Age, ...]:
    """The age of every campaign in a checkout."""
    lasts = page.load(root)
    found = []
    for campaign in CAMPAIGNS.values():
        last = lasts.get(campaign.name)
        passed_at = last.passed_at if last is not None else ""
        changes = changes_since(root, passed_at, campaign.covers) if passed_at else None
        found.append(age_of(campaign, passed_at, changes))
    return tuple(found)


def current(root: Path) -> frozenset[str]:
    """The campaigns whose last passing result counts for the working tree."""
    return frozenset(age.campaign for age in ages(root) if age.is_current)


def age_of(campaign: Campaign, passed_at: str, changes: Changes | None) -> Age:
    """Judge what git says; None: git does not know the commit.

    >>> age_of(CAMPAIGNS["packages"], "0123abc", Changes(3, ("pyproject.toml",))).why
    'changed since: pyproject.toml'
    """
    if not passed_at:
        return Age(campaign.name, "", None, False, "has never passed")
    if changes is None:
        return Age(campaign.name, passed_at, None, False, "not known, treated as changed")
    if not changes.paths:
        return Age(campaign.name, passed_at, changes.commits, True, "nothing has changed since")
    first, *others = changes.paths
    more = f" and {len(others)} more" if others else ""
    return Age(campaign.name, passed_at, changes.commits, False, f"changed since: {first}{more}")


def changes_since(root: Path, commit: str, covers: tuple[str, ...]) -> Changes | None:
    """What has changed since a commit, uncommitted and new files with it.

    None where git does not know the commit as one that the present one comes from: the clone is
    shallow, the commit was rebased away, or this is no checkout.
    """
    if _git(root, "merge-base", "--is-ancestor", commit, "HEAD") is None:
        return None
    count = _git(root, "rev-list", "--count", f"{commit}..HEAD")
    differ = _git(root, "diff", "--name-only", "-z", commit, "--", *covers)
    new = _git(root, "ls-files", "--others", "--exclude-standard", "-z", "--", *covers)
    if count is None or differ is None or new is None:
        return None
    return Changes(int(count), tuple(sorted({*_names(differ), *_names(new)})))


def _names(listed: str) -> list[str]:
    return [name for name in listed.split("\0") if name]


def _git(root: Path, *words: str) -> str | None:
    """What git answers; None when it refuses or is not installed."""
    try:
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return done.stdout if done.returncode == 0 else None
