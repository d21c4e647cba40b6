"""Match rules of devices: what they mean, and which are none."""

from __future__ import annotations

from fnmatch import fnmatchcase

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.wheelhouse.format.device_rules import WORDS, fits, judged, names_id, wrong_rules

FACTS = {"usb": ["0403:6001"], "interface": ["0e:01:00", "01:01:00"], "ID_MODEL": ["PTU-D46"]}


@pytest.mark.parametrize(
    ("match", "expected"),
    [
        ({}, True),
        ({"usb": "0403:6001"}, True),
        ({"interface": "video"}, True),
        ({"interface": "audio | hid"}, True),
        ({"interface": "0e:02"}, False),
        ({"ID_MODEL": "PTU-*"}, True),
        ({"ID_MODEL": "ptu-*"}, False),
        ({"ID_SERIAL": "*"}, True),
        ({"ID_SERIAL": "?*"}, False),
    ],
)
def test_all_rules_count(match: dict[str, str], expected: bool) -> None:
    assert fits(match, FACTS) is expected


@pytest.mark.parametrize(
    ("match", "told"),
    [
        ({"usb": "0403"}, "vendor:product"),
        ({"usb": "FTDI:6001"}, "vendor:product"),
        ({"interface": "camera"}, "class of interfaces"),
        ({"interface": "03:01:02:04"}, "class of interfaces"),
        ({"vendor": "0403"}, "no word"),
    ],
)
def test_what_can_never_match_is_told(match: dict[str, str], told: str) -> None:
    ((message, fix),) = wrong_rules(match)
    assert told in message
    assert fix


def test_typing_mistake_is_met_with_the_word_that_was_meant() -> None:
    ((_, fix),) = wrong_rules({"sub-system": "tty"})
    assert "'subsystem'" in fix


@pytest.mark.parametrize("word", sorted(WORDS))
def test_words_are_no_mistakes(word: str) -> None:
    pattern = {"usb": "16c0:05d?", "interface": "03:01"}.get(word, "x*")
    assert list(wrong_rules({word: pattern})) == []


@given(st.text(), st.lists(st.text(max_size=8), max_size=3))
def test_any_property_is_compared_as_shells_do(pattern: str, values: list[str]) -> None:
    (verdict,) = judged({"ID_ANY": pattern}, {"ID_ANY": values})
    wanted = [one.strip() for one in pattern.split("|")]
    found = [(value, one) for value in values or [""] for one in wanted]
    assert verdict.matched == any(fnmatchcase(value, one) for value, one in found)


def test_pattern_that_fits_all_names_nothing() -> None:
    assert not names_id({"usb": "*:*"})
    assert not names_id({"usb": "0403:6001|*"})
    assert names_id({"ID_MODEL": "PTU*"})
