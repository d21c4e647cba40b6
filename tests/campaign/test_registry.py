"""The registry: it covers what is there."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.campaign.registry import CAMPAIGNS, Campaign

ROOT = Path(__file__).parents[2]
each = pytest.mark.parametrize("campaign", CAMPAIGNS.values(), ids=CAMPAIGNS)


@each
def test_every_covered_path_exists(campaign: Campaign) -> None:
    assert campaign.covers
    for path in campaign.covers:
        assert any(ROOT.glob(path)), path


@each
def test_it_says_what_it_does(campaign: Campaign) -> None:
    assert campaign.sentence and "|" not in campaign.sentence
