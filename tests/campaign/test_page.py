"""The page of campaigns: written and read again, it says the same."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from tests.campaign import page
from tests.campaign.page import Last
from tests.campaign.registry import CAMPAIGNS

ROOT = Path(__file__).parents[2]
HASHES = st.text("0123456789abcdef", min_size=7, max_size=12)
LASTS = st.builds(
    Last,
    result=st.sampled_from([page.PASSED, page.FAILED, "12 of 500"]),
    commit=st.one_of(HASHES, HASHES.map(lambda commit: commit + page.DIRTY)),
    date=st.dates().map(str),
    minutes=st.integers(0, 10_000),
    machine=st.sampled_from(["2 × x86_64", "4 × aarch64"]),
    command=st.sampled_from(["./run campaign faults --seed 12", "./run campaign"]),
    passed_at=st.one_of(st.just(""), HASHES),
)


@given(st.dictionaries(st.sampled_from(sorted(CAMPAIGNS)), LASTS))
def test_the_page_is_read_as_it_was_written(lasts: dict[str, Last]) -> None:
    assert page.read(page.written(lasts)) == lasts


def test_a_result_takes_the_place_of_the_former_one(tmp_path: Path) -> None:
    (tmp_path / page.PAGE.parent).mkdir(parents=True)
    first = Last("12 of 500", "0123abc+", "2026-01-02", 5, "2 × x86_64", "./run campaign")
    second = Last(
        page.PASSED, "0123abc", "2026-01-03", 9, "2 × x86_64", "./run campaign", "0123abc"
    )
    page.keep(tmp_path, "faults", first)
    page.keep(tmp_path, "fuzz", first)
    page.keep(tmp_path, "faults", second)
    assert page.load(tmp_path) == {"faults": second, "fuzz": first}


def test_the_page_of_this_checkout_is_as_it_would_be_written() -> None:
    text = (ROOT / page.PAGE).read_text(encoding="utf-8")
    assert text == page.written(page.read(text)), "run `python -m tests.campaign --write`"
