"""What is written here is plain English: no word of `words.toml`, in no text and no name."""

from __future__ import annotations

import tomllib

import pytest

from nondum.host.config import reference
from tests import words

RULES = words.read()


@pytest.mark.parametrize("folder", sorted({name.split("/")[0] for name in words.files()}))
def test_no_text_and_no_name_has_a_word_that_is_not_written(folder: str) -> None:
    found: list[str] = []
    for name in words.files():
        if name.split("/")[0] == folder:
            path = words.ROOT / name
            found += words.in_text(RULES, name, path.read_text(encoding="utf-8"))
            if name.endswith(".py") and "/template/" not in name:
                found += words.in_names(RULES, name, words.names_of(path))
    assert not found, "instead: tests/words.toml"


def test_no_configuration_key_has_one() -> None:
    keys = [(0, key) for name in sorted(reference.keys()) for key in name.split(".")]
    assert not list(words.in_names(RULES, "configuration", keys))


def test_each_exception_has_a_reason_and_is_needed() -> None:
    rows = tomllib.loads(words.FILE.read_text(encoding="utf-8"))["spared"]
    assert all(row["reason"] for row in rows)
    names = list(words.files())
    for row in rows:
        place = row["path"]
        assert any(n == place or (place.endswith("/") and n.startswith(place)) for n in names)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Nobody asks.", ["a.py:1: Nobody"]),
        ("one\ntwo of its own", ["a.py:2: of its own"]),
        ("def test_nobody_asks", ["a.py:1: nobody"]),
        ("a wall clock, wall_s, headroom, chair, handshake, hearing", []),
    ],
)
def test_words_are_found_wherever_they_stand(text: str, found: list[str]) -> None:
    assert list(words.in_text(RULES, "a.py", text)) == found


@pytest.mark.parametrize(
    ("name", "is_found"),
    [("Desk", True), ("open_desk", True), ("desktop", False), ("Reads", False)],
)
def test_names_are_taken_apart_into_words(name: str, is_found: bool) -> None:
    assert bool(list(words.in_names(RULES, "a.py", [(1, name)]))) is is_found
