"""Phrases and names as a grammar."""

from __future__ import annotations

from nondum_speech.grammar import Vocabulary, jsgf


def rules(vocabulary: Vocabulary, *unsayable: str) -> list[str]:
    text = jsgf(vocabulary, frozenset(vocabulary.words).difference(unsayable))
    return text.splitlines()[2:] if text else []


def test_phrases_become_alternatives() -> None:
    vocabulary = Vocabulary(("[please] find {thing}", "stop"), {"thing": ("me", "lost people")})
    assert rules(vocabulary) == [
        "<thing> = [the | a | an] (me | lost people);",
        "public <said> = [please] find <thing> | stop;",
    ]


def test_slot_without_names_takes_any_phones() -> None:
    free, said = rules(Vocabulary(("note [that {text}]",)))
    assert free.startswith("<free> = (phone.aa | phone.ae")
    assert said == "public <said> = note [that <free>];"


def test_part_without_words_is_left_out() -> None:
    (said,) = rules(Vocabulary(("[!] stop",)))
    assert said.split() == ["public", "<said>", "=", "stop;"]


def test_words_stay_as_the_host_wrote_them() -> None:
    (said,) = rules(Vocabulary(("use the X-ray at André's",)))
    assert said == "public <said> = use the x-ray at andré's;"


def test_name_that_cannot_be_pronounced_is_left_out_alone() -> None:
    vocabulary = Vocabulary(("find {thing}", "дом"), {"thing": ("me", "дом")})
    assert rules(vocabulary, "дом") == [
        "<thing> = [the | a | an] (me);",
        "public <said> = find <thing>;",
    ]


def test_name_of_a_host_has_no_article() -> None:
    vocabulary = Vocabulary(("stop {addressee}", "find {who}"), {"addressee": ("mule",)})
    assert "<addressee> = (mule);" in rules(vocabulary)


def test_robot_with_an_unpronounceable_name_can_be_stopped() -> None:
    vocabulary = Vocabulary(("[{who}] [please] stop", "find {who}"), {"who": ("дом",)})
    assert rules(vocabulary, "дом") == ["public <said> = [please] stop;"]


def test_nothing_to_say_is_no_grammar() -> None:
    assert jsgf(Vocabulary(), frozenset()) is None
    assert not rules(Vocabulary(("find {thing}",), {"thing": ("дом",)}), "дом")
