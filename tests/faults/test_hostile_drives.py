"""Hostile drives, once through one daemon: each is told with its code, and nobody else notices.

Ten times through is `python -m tests.faults.drive_figures hostile`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.faults.hostile import DRIVES, FAMILIES, HostileDrive
from tests.faults.hostile.gauntlet import Gauntlet, gauntlet
from tests.kit.loop_devices import can_be_made

from nondum.host.lifecycle.children import KEPT

pytestmark = [pytest.mark.daemon, pytest.mark.timeout(300)]

AT_ONCE = 16
MOST_GROWTH_MB = 20.0
"""In a first round, where all is loaded that is ever kept; the long form judges the others."""
OF_A_CHILD = 4
"""Descriptors."""


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Gauntlet]:
    with gauntlet(tmp_path) as run:
        yield run


def test_corpus_is_as_big_as_it_is_meant_to_be() -> None:
    names = [drive.name for drive in DRIVES]
    assert len(names) == len(set(names))
    own = [drive for family, drives in FAMILIES.items() for drive in drives if family != "wheels"]
    assert len(own) >= 150
    assert len(FAMILIES["wheels"]) >= 60
    assert len(chosen()) >= 150


SELDOM = {"wheels": 16, "contents lists": 3, "manifests": 3, "file systems": 3}
"""Of families that have tests of their own, or are dear: one of so many."""


def chosen() -> list[HostileDrive]:
    """Every other drive of each family, and fewer of some."""
    return [
        drive for family, drives in FAMILIES.items() for drive in drives[:: SELDOM.get(family, 2)]
    ]


def test_hostile_drives_are_told_with_their_codes(run: Gauntlet) -> None:
    drives = run.make([d for d in chosen() if can_be_made() or not d.is_image])
    run.measure()
    run.round(drives, at_once=AT_ONCE)
    run.measure()
    told = run.outcome
    assert not told.wrong
    assert not told.without_remedy
    assert not told.canaries
    assert not told.strays
    assert not told.touched
    assert not told.controls
    assert len(told.pids) == 1
    before, after = told.footprints
    # Children that are kept for a while are no leak; the long form waits until they have gone.
    assert after.descriptors - before.descriptors <= KEPT * OF_A_CHILD
    assert after.rss_mb - before.rss_mb <= MOST_GROWTH_MB
    assert (after.mounts, after.zombies) == (before.mounts, before.zombies)
