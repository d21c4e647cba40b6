"""What recognisers are told: patterns with slots, and the names that fit."""

from __future__ import annotations

import json
import re

from tests.planning.strangers import ROVER

from nondum.host.people.sayings import SAYINGS_BYTES, sayings
from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.words.asking import ASKED
from nondum.planning.words.phrases import Phrasebook, phrasebook
from nondum.planning.words.stop_words import (
    STOP_PATTERNS,
    host_behind_stop,
    is_stop,
    is_stop_for_other,
    stop_patterns,
)
from nondum.sdk.description import Fragment, Label, Phrase, PluginDescription

DOMAIN = "(define (domain d) (:predicates (seen ?c - class) (met ?t - target)))"

STOPPING = list(STOP_PATTERNS)


def book(
    *phrases: str, classes: tuple[str, ...] = (), labels: tuple[Label, ...] = ()
) -> Phrasebook:
    objects = f"(:objects {' '.join(classes)} - class)" if classes else ""
    problem = f"(define (problem p) (:domain d) {objects})"
    described = PluginDescription(
        name="plain",
        version="1",
        fragments=(Fragment("domain.pddl", DOMAIN), Fragment("problem.pddl", problem)),
        phrases=tuple(Phrase(p, "(seen ?c)" if "{c:" in p else "(met ?t)") for p in phrases),
        labels=labels,
    )
    contributions = (Contribution.from_description(described, host=ROVER, component="plain"),)
    return phrasebook(contributions, merge(contributions, ROVER))


def test_patterns_are_told_with_all_names_that_fit() -> None:
    labels = (Label("person", "people"), Label("person", "the persons"))
    told = sayings(
        book("[please] find {c:class} [in {words:text}]", classes=("person", "dog"), labels=labels)
    )
    assert told == {
        "phrases": [*STOPPING, *ASKED, "[please] find {class} [in {text}]"],
        "names": {"class": ["dog", "people", "person", "persons"]},
        "stops": STOPPING,
    }


def test_phrase_without_a_name_for_a_slot_cannot_be_said() -> None:
    told = sayings(book("find {c:class}", "meet {t:target}", classes=("dog",)))
    assert told["phrases"] == [*STOPPING, *ASKED, "find {class}"]
    assert told["names"] == {"class": ["dog"]}


def test_names_that_do_not_fit_into_a_packet_are_left_out() -> None:
    classes = tuple(f"thing-number-{n}-of-very-many" for n in range(2000))
    told = sayings(book("find {c:class}", classes=classes))
    assert told["phrases"] == [*STOPPING, *ASKED, "find {class}"]
    assert SAYINGS_BYTES / 4 < len(json.dumps(told)) <= SAYINGS_BYTES + 100


def test_phrases_are_left_out_when_names_do_not_suffice() -> None:
    many = [f"find {{c:class}} number {n} {'very ' * 20}soon" for n in range(2000)]
    told = sayings(book(*many, classes=("dog",)))
    assert told["names"] == {"class": ["dog"]}
    assert 0 < len(json.dumps(told)) <= SAYINGS_BYTES + 100


def test_hosts_are_spoken_to_by_name() -> None:
    told = sayings(book("find {c:class}", classes=("dog",)), ["big-mule", "rover"])
    assert told == {
        "phrases": [
            *stop_patterns("{addressee}"),
            *(f"[{{addressee}}] {said}" for said in (*ASKED, "find {class}")),
        ],
        "names": {"class": ["dog"], "addressee": ["big mule", "rover"]},
        "stops": list(stop_patterns("{addressee}")),
    }


def test_all_that_stops_the_robot_does() -> None:
    for said in STOPPING:
        assert is_stop(re.sub(r"[\[\]]", "", said))
        assert is_stop(re.sub(r"\[.*?\]", "", said))


def test_all_that_stops_a_robot_that_is_named_does() -> None:
    patterns = [said.replace("{addressee}", "big mule") for said in stop_patterns("{addressee}")]
    for said in patterns:
        plain, short = re.sub(r"[\[\]]", "", said), re.sub(r"\[.*?\]", "", said)
        behind = [host_behind_stop(one, ["big-mule"]) == "big-mule" for one in (plain, short)]
        before = is_stop_for_other(plain) and is_stop(short)
        assert before or all(behind), said
    assert len(patterns) == 2 * len(STOPPING)
