"""The registry: it covers what is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.campaign.registry import CAMPAIGNS, Campaign

ROOT = Path(__file__).parents[2]
MARK = re.compile(r"mark\.(long|short)\(\s*\"(\w+)\"")
each = pytest.mark.parametrize("campaign", CAMPAIGNS.values(), ids=CAMPAIGNS)


@each
def test_every_covered_path_exists(campaign: Campaign) -> None:
    assert campaign.covers
    for path in campaign.covers:
        assert any(ROOT.glob(path)), path


@each
def test_it_says_what_it_does(campaign: Campaign) -> None:
    assert campaign.sentence and "|" not in campaign.sentence


def marks() -> set[tuple[str, str]]:
    """`long` or `short`, and the campaign that a marker of a test names."""
    # What tests of the runner write for their own pytest are no tests of a campaign.
    files = (f for f in (ROOT / "tests").rglob("*.py") if f.parent != ROOT / "tests/runner")
    return {found for file in files for found in MARK.findall(file.read_text(encoding="utf-8"))}


def test_markers_name_campaigns() -> None:
    of_pytest = {one.name for one in CAMPAIGNS.values() if one.is_pytest}
    assert {name for kind, name in marks() if kind == "long"} <= of_pytest
    assert {name for kind, name in marks() if kind == "short"} <= CAMPAIGNS.keys()


@pytest.mark.parametrize("name", [one.name for one in CAMPAIGNS.values() if one.is_pytest])
def test_each_campaign_of_pytest_has_a_test(name: str) -> None:
    assert ("long", name) in marks()
