"""The command line of campaigns."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.campaign import __main__ as command
from tests.campaign.age import Age
from tests.campaign.registry import CAMPAIGNS


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        command.main(["--help"])
    assert ended.value.code == 0
    assert "./run campaign faults fuzz --minutes 20" in capsys.readouterr().out


def test_list_tells_each_with_its_age(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert command.main(["--list", "--json"], tmp_path) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["campaign"] for row in rows] == list(CAMPAIGNS)
    assert {row["why"] for row in rows} == {"has never passed"}
    assert command.main(["--list"], tmp_path) == 0
    assert "never run; has never passed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fault"], "no campaign is called fault"),
        (["--minutes", "0"], "must be more than 0"),
        (["--minutes", "soon"], "--minutes"),
        (["--minutes", "nan"], "must be more than 0"),
    ],
)
def test_what_makes_no_sense_is_refused(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        command.main(words)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


def test_those_that_have_to_run_come_first_and_those_that_ran_last_come_last() -> None:
    def age(name: str, *, is_current: bool) -> Age:
        return Age(name, "", None, is_current, "")

    found = [
        age("faults", is_current=True),
        age("fuzz", is_current=False),
        age("drives", is_current=False),
        age("peers", is_current=False),
    ]
    dates = {"faults": "2026-01-01", "fuzz": "2026-03-01", "drives": "2026-02-01"}
    assert command.oldest_first(found, dates) == ["peers", "drives", "fuzz", "faults"]
