"""What is asked of a child and what comes of it arrive as they were meant, errors with class."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.rpc.outcomes import packed, refused, unpacked
from nondum.sdk.errors import DriveGone, GoalRefused, NondumError, Problem, ProtocolViolation

PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats(allow_nan=False)
    | st.text(st.characters(codec=None)),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


class OfOnePackage(GoalRefused):
    """As some are that only one package knows."""


@given(PLAIN)
def test_values_arrive_unchanged(value: Any) -> None:
    assert unpacked(packed(value)) == value


def test_name_of_a_file_that_is_no_utf_8_arrives() -> None:
    name = b"caf\xe9".decode("utf-8", "surrogateescape")
    with pytest.raises(DriveGone) as gone:
        unpacked(refused(DriveGone(Problem("DRIVE_GONE", name))))
    assert gone.value.problems[0].message == name


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (DriveGone(Problem("DRIVE_GONE", "pulled")), DriveGone),
        (OfOnePackage(Problem("A", "a"), Problem("B", "b")), GoalRefused),
    ],
)
def test_error_keeps_its_class_and_problems(error: NondumError, kind: type[NondumError]) -> None:
    with pytest.raises(NondumError) as raised:
        unpacked(refused(error))
    assert type(raised.value) is kind
    assert raised.value.problems == error.problems


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"value": 7},
        {"value": b"\xc1"},
        {"value": b"\x01\x01"},
        {"value": b"\x91" * 5_000},
        {"error": "DriveGone"},
        {"error": "Problem", **packed([{"code": "A", "message": "a"}])},
        {"error": ["DriveGone"], **packed([{"code": "A", "message": "a"}])},
        *({"error": "DriveGone", **packed(wrong)} for wrong in ([], 7, [{"code": "A"}])),
    ],
    ids=repr,
)
def test_reply_that_is_none_breaks_the_protocol(body: dict[str, Any]) -> None:
    with pytest.raises(ProtocolViolation):
        unpacked(body)
