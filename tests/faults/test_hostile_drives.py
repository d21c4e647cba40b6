"""Hostile drives, once through one daemon: each is told with its code, and all else goes on.

One of each kind; all of them, ten times through, is `python -m tests.faults.drive_figures hostile`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest
from tests.faults.hostile import DRIVES, FAMILIES, HostileDrive
from tests.faults.hostile.gauntlet import Gauntlet, gauntlet
from tests.kit.loop_devices import can_be_made

from nondum.host.jobs.children import KEPT

pytestmark = pytest.mark.daemon

AT_ONCE = 16
MOST_GROWTH_MB = 20.0
"""In a first round, where all is loaded that is ever kept; the long form judges the others."""
OF_A_CHILD = 4
"""Descriptors."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Gauntlet]:
    with gauntlet(tmp_path_factory.mktemp("hostile")) as run:
        run.measure()
        yield run


def test_corpus_is_as_big_as_it_is_meant_to_be() -> None:
    names = [drive.name for drive in DRIVES]
    assert len(names) == len(set(names))
    own = [drive for family, drives in FAMILIES.items() for drive in drives if family != "wheels"]
    assert len(own) >= 150
    assert len(FAMILIES["wheels"]) >= 60
    chosen = [drive for drives in FAMILIES.values() for drive in one_of_each(drives)]
    assert {drive.code for drive in chosen} == {drive.code for drive in DRIVES}
    assert len(chosen) >= 75


def one_of_each(drives: Sequence[HostileDrive]) -> list[HostileDrive]:
    """Of a family, the first drive of each kind: of those that must come to the same."""
    kinds = {(d.code, d.also, d.beside, d.is_image): d for d in reversed(drives)}
    return sorted(kinds.values(), key=drives.index)


@pytest.mark.parametrize("family", FAMILIES)
def test_hostile_drives_are_told_with_their_codes(run: Gauntlet, family: str) -> None:
    chosen = [d for d in one_of_each(FAMILIES[family]) if can_be_made() or not d.is_image]
    run.round(run.make(chosen), at_once=AT_ONCE)
    run.measure()
    told = run.outcome
    assert not told.wrong
    assert not told.without_remedy
    assert not told.canaries
    assert not told.strays
    assert not told.touched
    assert not told.controls
    assert len(told.pids) == 1
    before, after = told.footprints[0], told.footprints[-1]
    # Children that are kept for a while are no leak; the long form waits until they have gone.
    assert after.descriptors - before.descriptors <= KEPT * OF_A_CHILD
    assert after.rss_mb - before.rss_mb <= MOST_GROWTH_MB
    assert (after.mounts, after.zombies) == (before.mounts, before.zombies)
