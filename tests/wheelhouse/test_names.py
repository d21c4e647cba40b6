"""Why a path may not stand in a list, in words that tell what is wrong with it."""

from __future__ import annotations

import pytest

from nondum.wheelhouse.format import names


@pytest.mark.parametrize(
    ("path", "why"),
    [
        ("a/" * 127 + "aa", "longer"),
        ("/etc/passwd", "leaves the payload folder"),
        ("a/../b", "leaves the payload folder"),
        ("..", "leaves the payload folder"),
        ("a b", "characters"),
        ("a\\b", "characters"),
        ("a\nb", "characters"),
        ("a/./b", "shortest form"),
        ("./a", "shortest form"),
    ],
)
def test_paths_that_are_no_plain_ones_are_told_why(path: str, why: str) -> None:
    assert why in (names.path_flaw(path) or "")


def test_plain_paths_are_taken() -> None:
    assert names.path_flaw("a/" * 127 + "a") is None
    assert names.path_flaw("wheels/a+b_c-1.0~rc1-py3-none-any.whl") is None
