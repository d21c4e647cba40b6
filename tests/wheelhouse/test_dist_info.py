"""Limits within which a wheel's metadata is read, each for itself."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.wheelhouse.hostile_wheels import METADATA, NAME, WHEEL

from nondum.wheelhouse.wheels import dist_info
from nondum.wheelhouse.wheels.dist_info import WheelName

NAMED = WheelName.parse(NAME)
PLAIN, TAGGED = METADATA.decode(), WHEEL.decode()


def headers(more: str) -> Iterator[str]:
    return dist_info.metadata_flaws(PLAIN + more, NAMED)


def tags(more: str) -> Iterator[str]:
    return dist_info.wheel_flaws(TAGGED + more, NAMED)


@pytest.mark.parametrize(
    ("flaws", "words"),
    [
        pytest.param(
            headers(f"R: {'x' * dist_info.MAX_HEADERS}\n"), "headers without end", id="characters"
        ),
        pytest.param(headers("R:\n" * dist_info.MAX_LINES), "headers without end", id="lines"),
        pytest.param(
            headers("Requires-Dist: a>=1\n" * (dist_info.MAX_REQUIREMENTS // 4 + 1)),
            "headers without end",
            id="short dependencies",
        ),
        pytest.param(
            headers(f"Requires-Dist: {'a' * 1900}\n" * 140),
            "dependencies without end",
            id="dependencies",
        ),
        pytest.param(headers(f"Requires-Dist: {'a' * 2001}\n"), "is too long", id="dependency"),
        pytest.param(headers(f"Requires-Python: >={'1' * 250}\n"), "no version", id="specifier"),
        pytest.param(tags("Tag: py3-none-any\n" * dist_info.MAX_TAGS), "is none", id="tags"),
        pytest.param(tags(f"Tag: py3-none-{'a' * 250}\n"), "is none", id="tag"),
    ],
)
def test_what_is_too_long_is_not_read(flaws: Iterator[str], words: str) -> None:
    (flaw,) = flaws
    assert words in flaw


def test_plain_metadata_passes() -> None:
    assert not list(headers("Requires-Dist: a>=1\nRequires-Python: >=3.11\n"))
    assert not list(tags("Tag: py2-none-any\n"))
