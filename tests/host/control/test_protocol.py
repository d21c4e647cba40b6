"""Lines of the control protocol hold whatever a host has to tell."""

from __future__ import annotations

import re

from hypothesis import given
from hypothesis import strategies as st

from nondum.host.control.protocol import (
    Request,
    decode_answer,
    decode_request,
    encode_problems,
    encode_request,
    encode_result,
)
from nondum.sdk.errors import Problem

PAIR = re.compile("[\ud800-\udbff][\udc00-\udfff]")
TEXTS = st.text(st.characters()).filter(lambda text: not PAIR.search(text))
"""Half letters, which no UTF-8 has, are among them: names of files may have them. Two that make a
whole one are that."""


@given(TEXTS, TEXTS)
def test_any_text_can_be_asked_and_answered(key: str, text: str) -> None:
    assert decode_request(encode_request(Request("why", {key: text}))).arguments == {key: text}
    assert decode_answer(encode_result({key: text})) == ({key: text}, ())
    problem = Problem("TEST", f"said {text}", where=key)
    assert decode_answer(encode_problems([problem])) == (None, (problem,))


@given(TEXTS)
def test_an_answer_is_one_line(text: str) -> None:
    assert encode_result(text).count(b"\n") == 1
