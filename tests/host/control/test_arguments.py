"""Arguments of requests: what they should be, or a violation in words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.control.arguments import Arguments
from nondum.sdk.errors import ProtocolViolation

READERS: dict[str, Callable[[Arguments], Any]] = {
    "text": lambda given: given.text("it"),
    "optional_text": lambda given: given.optional_text("it"),
    "choice": lambda given: given.choice("it", "achieve", "maintain"),
    "number": lambda given: given.number("it", 7, at_least=0, at_most=9),
    "flag": lambda given: given.flag("it"),
    "triple": lambda given: given.triple("it"),
}
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@pytest.mark.parametrize(
    ("reader", "value", "read"),
    [
        ("text", "eye", "eye"),
        ("choice", "maintain", "maintain"),
        ("choice", None, None),
        ("number", 0, 0),
        ("number", None, 7),
        ("flag", True, True),
        ("triple", [1, -2.5, 0], (1.0, -2.5, 0.0)),
        ("triple", None, None),
    ],
)
def test_what_is_sound_is_read(reader: str, value: Any, read: Any) -> None:
    assert READERS[reader](Arguments({"it": value})) == read


@pytest.mark.parametrize(
    ("reader", "value", "words"),
    [
        ("text", None, "it should be a text, not nothing"),
        ("text", 3, "not 3"),
        ("choice", "perhaps", "achieve or maintain, not 'perhaps'"),
        ("number", 10, "from 0 to 9"),
        ("number", -1, "from 0 to 9"),
        ("number", True, "not True"),
        ("number", "5", "not '5'"),
        ("flag", 1, "true or false"),
        ("triple", [1, 2], "three finite numbers"),
        ("triple", [1, 2, float("inf")], "three finite numbers"),
        ("triple", [1, 2, "3"], "three finite numbers"),
    ],
)
def test_wrong_argument_is_told(reader: str, value: Any, words: str) -> None:
    with pytest.raises(ProtocolViolation, match=r"CONTROL_ARGUMENT") as refused:
        READERS[reader](Arguments({"it": value}))
    assert words in str(refused.value)


@given(st.sampled_from(sorted(READERS)), ANYTHING)
def test_nothing_but_a_violation_is_raised(reader: str, value: Any) -> None:
    try:
        READERS[reader](Arguments({"it": value}))
    except ProtocolViolation as violation:
        assert violation.code == "CONTROL_ARGUMENT"
