"""What people are told is kept, in order, and within bounds whoever it is told of."""

from __future__ import annotations

from nondum.host.mind.people import MAX_CHARACTERS, MAX_SENTENCES, People


def test_sentences_are_numbered_and_the_last_ones_kept() -> None:
    people = People(lambda: 5.0)
    for number in range(MAX_SENTENCES + 3):
        people.tell(f"sentence {number + 1}")
    kept = list(people)
    assert len(kept) == MAX_SENTENCES
    assert [told.text for told in people.since(people.last_number - 2)] == [
        f"sentence {MAX_SENTENCES + 2}",
        f"sentence {MAX_SENTENCES + 3}",
    ]


def test_sentence_without_end_is_cut() -> None:
    people = People(lambda: 5.0)
    people.tell("x" * MAX_CHARACTERS)
    people.tell("y" * 10**6)
    whole, cut = people
    assert whole.text == "x" * MAX_CHARACTERS
    assert cut.text == "y" * MAX_CHARACTERS + "…"
