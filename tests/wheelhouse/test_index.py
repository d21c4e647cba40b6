"""The captured descriptions: what is no index is refused."""

from __future__ import annotations

import pytest

from nondum.sdk.errors import PayloadRefused
from nondum.wheelhouse import index

PLAIN = b'{"format": 1, "components": {}}'


@pytest.mark.parametrize(
    ("data", "code"),
    [
        pytest.param(PLAIN + b" " * index.MAX_BYTES, "TOO_LARGE", id="too long"),
        pytest.param(b"{", "INDEX_INVALID", id="no JSON"),
        pytest.param(b"[" * 100_000, "INDEX_INVALID", id="too deep"),
        pytest.param(b"[]", "INDEX_INVALID", id="a list"),
        pytest.param(PLAIN.replace(b"1", b"2"), "INDEX_INVALID", id="another format"),
        pytest.param(PLAIN.replace(b"{}", b"[]"), "INDEX_INVALID", id="no table"),
        pytest.param(PLAIN.replace(b"{}", b'{"\\ud83e": {}}'), "INDEX_INVALID", id="half a letter"),
        pytest.param(PLAIN.replace(b"{}", b'{"a": 1}'), "DESCRIPTION_INVALID", id="no description"),
    ],
)
def test_what_is_no_index_is_refused(data: bytes, code: str) -> None:
    assert index.parse(PLAIN, "index.json") == {}
    with pytest.raises(PayloadRefused) as refused:
        index.parse(data, "index.json")
    assert refused.value.code == code


def test_half_a_letter_is_told() -> None:
    with pytest.raises(PayloadRefused) as refused:
        index.parse(PLAIN.replace(b"{}", b'{"\\ud800": {}}'), "index.json")
    assert "half a letter" in refused.value.problems[0].message
