"""Which releases are let in, by what was here, the clock, and what the payload says of itself."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from nondum.host.core.events.payloads import PayloadFound
from nondum.host.core.records.moment import Moment
from nondum.host.core.state import Highwater, HostState
from nondum.host.lifecycle import admission
from nondum.wheelhouse.format.signatures import Grant
from nondum.wheelhouse.trust.judging import EARLIEST

LAMP = "org.example.lamp"
NOW_S = 1_800_000_000
BUILT = "2027-01-15T08:00:00Z"
FOUND = PayloadFound(
    payload="k",
    drive="a",
    folder=Path("/a"),
    digest="d",
    payload_id=LAMP,
    version="1",
    release=7,
    grant=Grant(role="one", owners=("one", "two")),
    built=BUILT,
)
BARE = HostState("spot")


def codes(found: PayloadFound, state: HostState = BARE, wall_s: float = NOW_S) -> list[str]:
    problems = tuple(admission.release_problems(state, found, Moment(0.0, wall_s)))
    assert all(problem.fix for problem in problems)
    return [problem.code for problem in problems]


def here(release: int, *, digest: str = "d", owner: str = "one") -> HostState:
    return replace(BARE, highwater={LAMP: Highwater(release, digest, owner)})


@pytest.mark.parametrize(
    ("release", "found"),
    [
        (7, []),
        (NOW_S, []),
        (NOW_S + 1_000_000, []),
        (NOW_S + 1_000_001, ["RELEASE_JUMP"]),
        (2**53, ["RELEASE_JUMP"]),
    ],
)
def test_the_first_release_cannot_shut_out_all_later_ones(release: int, found: list[str]) -> None:
    assert codes(replace(FOUND, release=release)) == found


def test_a_clock_that_is_behind_keeps_no_honest_release_out() -> None:
    """Releases are the times at which they were built, unless their maker says otherwise."""
    month_later = NOW_S + 30 * 86400
    found = replace(FOUND, release=month_later, built="2027-02-14T08:00:00Z")
    assert codes(found, here(NOW_S), wall_s=0.0) == []
    assert codes(replace(found, built=BUILT), here(NOW_S), wall_s=0.0) == ["RELEASE_JUMP"]


def test_a_date_in_the_far_future_is_not_believed() -> None:
    found = replace(FOUND, release=200_000_000_000, built="9000-01-01T00:00:00Z")
    assert codes(found) == ["RELEASE_JUMP"]
    last = int(EARLIEST.timestamp()) + admission.FARTHEST_DATE_S + admission.RELEASE_JUMP
    assert codes(replace(found, release=last)) == []
    assert codes(replace(found, release=last + 1)) == ["RELEASE_JUMP"]


@pytest.mark.parametrize(
    ("release", "digest", "found"),
    [
        (9, "d", []),
        (8, "d", []),
        (8, "e", ["RELEASE_CONFLICT"]),
        (7, "d", ["ROLLBACK"]),
        (7, "e", ["ROLLBACK"]),
        (0, "e", ["ROLLBACK"]),
    ],
)
def test_releases_only_go_up(release: int, digest: str, found: list[str]) -> None:
    assert codes(replace(FOUND, release=release, digest=digest), here(8)) == found


def test_what_the_owner_declares_void_is_forgotten() -> None:
    grant = replace(FOUND.grant, most_release=100)
    assert codes(replace(FOUND, grant=grant), here(5000)) == []
    assert codes(replace(FOUND, grant=grant, release=50), here(60)) == ["ROLLBACK"]


@pytest.mark.parametrize("fleet", ["", "survey"])
def test_an_id_stays_with_its_first_owner_for_any_fleet(fleet: str) -> None:
    found = replace(FOUND, fleet=fleet)
    assert codes(found, here(7)) == []
    assert codes(found, here(7, owner="two")) == ["ID_OWNED_BY"]


def test_an_id_is_free_once_the_trust_file_gives_it_to_other_owners() -> None:
    assert codes(FOUND, here(7, owner="former")) == []


def test_nothing_is_said_of_a_list_that_is_not_believed() -> None:
    assert codes(replace(FOUND, version="", release=0), here(7)) == []
