"""What is wrong with a RECORD, in words."""

from __future__ import annotations

import pytest
from tests.wheelhouse.hostile_wheels import digest

from nondum.wheelhouse.wheels import record
from nondum.wheelhouse.wheels.record import Row

DIGEST = digest(b"")


def test_rows_are_read_by_path() -> None:
    found = record.parse(f"a.py,sha256={DIGEST},0\n\nRECORD,,\n")
    assert found["RECORD"] == Row("", None)
    assert found["a.py"].size == 0
    assert found["a.py"].sha256.startswith("e3b0c442")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("a,b\n", "three columns", id="two columns"),
        pytest.param("a,,\na,,\n", "stands twice", id="twice"),
        pytest.param(f"{'a' * 200_000},,\n", "field larger", id="a field without end"),
        pytest.param("a,md5=00,1\n", "not sha256", id="weak digest"),
        pytest.param("a,sha256=*,1\n", "no base64", id="no base64"),
        pytest.param("a,sha256=AAAA,1\n", "none of sha256", id="short digest"),
        pytest.param(f"a,sha256={DIGEST},six\n", "no number", id="size in words"),
        pytest.param(f"a,sha256={DIGEST},-1\n", "no number", id="size below zero"),
        pytest.param(f"a,sha256={DIGEST},{'1' * 21}\n", "no number", id="size without end"),
    ],
)
def test_what_is_wrong_with_a_row_is_told(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        record.parse(text)


def test_rows_without_end_are_not_read() -> None:
    with pytest.raises(ValueError, match="more than"):
        record.parse("".join(f"{number},,\n" for number in range(record.MAX_ROWS + 1)))
