"""The person of the demonstration understands what was said, and nothing that was not."""

from __future__ import annotations

from pathlib import Path

import pytest
from demo.search.person import Person
from demo.search.searching import ALERT
from demo.search.three_hosts import OTHER_SENTENCES


@pytest.fixture(scope="module")
def person(tmp_path_factory: pytest.TempPathFactory) -> Person:
    return Person(tmp_path_factory.mktemp("person") / "voice", expects=(ALERT, *OTHER_SENTENCES))


def understood(person: Person, words: str, folder: Path) -> tuple[str, ...]:
    person.say(words, folder / "said.wav")
    return person.understood(folder / "said.wav")


def test_alert_is_understood(person: Person, tmp_path: Path) -> None:
    assert understood(person, "I can see a person.", tmp_path) == (ALERT,)


@pytest.mark.parametrize(
    "words",
    [
        "I cannot see a person.",
        "I can see a robot.",
        "panther: search for people is reached",
        "the host panther is here",
        "speech is active",
        "",
    ],
)
def test_other_sentences_are_no_alert(person: Person, words: str, tmp_path: Path) -> None:
    assert ALERT not in understood(person, words, tmp_path)


def test_file_is_there_only_once_it_is_whole(person: Person, tmp_path: Path) -> None:
    person.say("hello", tmp_path / "a.wav")
    assert [path.name for path in tmp_path.iterdir()] == ["a.wav"]
