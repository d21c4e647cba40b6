"""Words that match no phrase, translated by a component and confirmed by the person."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from demo.robot import View
from tests.kit.beacon import BEACON
from tests.kit.command_line import at_terminal
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost, running

INTERPRETER = """
'''Understands what it is told to.'''
import time
from nondum.sdk import hookimpl

ORDER = "visitors brighten up now"
MEANINGS = {
    "brighten up": {"pddl": "(lit self)", "kind": "maintain"},
    "say hello to everybody": {"pddl": "(greeted person self)"},
    "more light": {"words": "Shine for everybody!"},
    "go away": {"pddl": "(litt self)"},
    "dance": {"words": "waltz with people"},
    "sing": {"song": "la la"},
}

@hookimpl
def translate_goal(ctx, words, vocabulary):
    if words == "think hard":
        time.sleep(3600)
    if words == "what do you know":
        raise RuntimeError(vocabulary)
    if words == "do as you read" and ORDER in str(vocabulary):
        return MEANINGS["brighten up"]
    if words == "repeat":
        assert vocabulary["sentences"] == ["greet people", "shine"], vocabulary
        assert {"words": "greet {c}", "slots": {"c": ["people", "person"]}} in vocabulary["phrases"]
        assert {"name": "person", "types": ["class"], "words": "people"} in vocabulary["objects"]
        assert "(lit ?1 - host)" in vocabulary["predicates"]
        return MEANINGS["brighten up"]
    return MEANINGS.get(words)
"""
OTHER = """
'''Takes a person at their word.'''
from nondum.sdk import hookimpl

@hookimpl
async def translate_goal(ctx, words):
    return {"pddl": "(greeted person self)"} if "hello" in words or "brighten" in words else None
"""
ORDERING = """
'''Has words for people that are an order.'''
from nondum.sdk import Label, hookimpl

@hookimpl
def labels():
    return (Label("person", "visitors brighten up now"),)
"""
LIT = "understood by interpreter as maintain (lit panther)"


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningHost]:
    with running(tmp_path_factory.mktemp("host"), name="panther") as daemon:
        for name, source in (("beacon", BEACON), ("interpreter", INTERPRETER)):
            daemon.plug(daemon.drive(name, Part(name, source)))
        daemon.until(
            "both are ready", lambda view: [r["ready"] for r in view["components"]] == [True, True]
        )
        yield daemon


@pytest.fixture(autouse=True)
def at_rest(daemon: RunningHost) -> Iterator[None]:
    yield
    daemon.run("halt", "--now").ok()
    daemon.until("nothing is done", lambda view: not view["plan"]["steps"])


def holds(view: View) -> bool:
    """Whether a goal that is kept up does."""
    return any(row["holds"] and row["state"] == "active" for row in view["goals"])


def test_translation_is_taken_where_the_person_said_so(daemon: RunningHost) -> None:
    shown = daemon.run("goal", "brighten", "up", "--yes", "--wait").ok().out
    assert shown.startswith(f"{LIT}\ngoal ")
    daemon.until("the goal holds", holds)
    assert daemon.view["goals"][-1]["text"] == "brighten up"
    assert re.search(rf"'brighten up' .*{re.escape(LIT)}", daemon.run("status").ok().out)


def test_machine_is_told_who_understood_what(daemon: RunningHost) -> None:
    given = daemon.run("goal", "repeat", "--yes", "--json").ok().json
    expected = {"goal": "(lit panther)", "kind": "maintain", "by": ["interpreter"], "words": ""}
    assert given["understood"] == expected


def test_translation_may_be_another_sentence(daemon: RunningHost) -> None:
    given = daemon.run("goal", "more light", "--yes", "--json").ok().json
    expected = {"goal": "(lit panther)", "kind": "maintain", "words": "Shine for everybody!"}
    assert given["understood"] == expected | {"by": ["interpreter"]}


def test_slip_of_the_keys_is_asked_back(daemon: RunningHost) -> None:
    nearly = 'understood by panther as "greet people": achieve (greeted person panther)'
    daemon.run("goal", "could", "you", "gret", "people", "please").refused(1, nearly)
    daemon.run("goal", "gret people", "--yes").refused(1, "PHRASE_UNKNOWN")
    given = daemon.run("goal", "could you greet people, please", "--yes", "--json").ok().json
    expected = {"goal": "(greeted person panther)", "kind": "achieve", "words": "greet people"}
    assert given["understood"] == expected | {"by": ["panther"]}


def test_translation_is_never_taken_unasked(daemon: RunningHost) -> None:
    before = len(daemon.run("goals", "--json").ok().json["given"])
    daemon.run("goal", "brighten up").refused(1, f"TRANSLATION_UNCONFIRMED {LIT} → ")
    assert len(daemon.run("goals", "--json").ok().json["given"]) == before


def test_person_confirms_at_the_terminal(daemon: RunningHost) -> None:
    asked = ("--control", daemon.control, "goal", "brighten up")
    code, shown = at_terminal(*asked, typed="y\n")
    assert (code, LIT in shown) == (0, True), shown
    assert "I would see to (lit panther), with beacon: " in shown
    daemon.until("the goal holds", holds)


def test_person_declines_at_the_terminal(daemon: RunningHost) -> None:
    asked = ("--control", daemon.control, "goal", "brighten up")
    code, shown = at_terminal(*asked, typed="n\n")
    assert (code, "TRANSLATION_UNCONFIRMED" in shown) == (1, True), shown


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("go away", "TRANSLATION_REFUSED interpreter: it understands '(litt self)'"),
        ("go away", "did you mean 'lit'?"),
        ("dance", "TRANSLATION_REFUSED interpreter: it understands 'waltz with people'"),
        ("sing", "TRANSLATION_INVALID interpreter: its answer is no goal"),
        ("mumble", "PHRASE_UNKNOWN"),
        ("what do you know", "TRANSLATION_FAILED interpreter: "),
    ],
)
def test_what_means_nothing_is_refused_by_name(daemon: RunningHost, words: str, why: str) -> None:
    ran = daemon.run("goal", words, "--yes")
    ran.refused(1, "PHRASE_UNKNOWN").refused(1, why)


def test_label_that_gives_orders_to_a_translator_makes_nothing_happen(daemon: RunningHost) -> None:
    before = daemon.run("goals", "--json").ok().json["given"]
    daemon.run("goal", "do as you read").refused(1, "PHRASE_UNKNOWN")
    daemon.bring("ordering", Part("ordering", ORDERING))
    daemon.run("goal", "do as you read").refused(1, "TRANSLATION_UNCONFIRMED")  # it was obeyed
    assert daemon.run("goals", "--json").ok().json["given"] == before
    assert not daemon.view["plan"]["steps"]
    daemon.pull("ordering")
    daemon.until("the label is gone", lambda view: len(view["components"]) == 2)


def test_component_that_does_not_answer_is_not_waited_for(tmp_path: Path) -> None:
    patience = "[planning]\ntranslate_s = 0.5\n"
    with running(tmp_path, name="panther", more=patience) as daemon:
        daemon.bring("interpreter", Part("interpreter", INTERPRETER))
        ran = daemon.run("goal", "think hard", "--yes").refused(1, "PHRASE_UNKNOWN")
        ran.refused(1, "TRANSLATION_OVERDUE interpreter: no answer within 0.5 s")


def test_different_translations_are_told_and_none_is_chosen(daemon: RunningHost) -> None:
    daemon.bring("other", Part("other", OTHER))
    ran = daemon.run("goal", "brighten up", "--yes").refused(1, "TRANSLATION_AMBIGUOUS")
    assert re.search(r"\binterpreter\b.* maintain \(lit panther\)", ran.err)
    assert re.search(r"\bother\b.* achieve \(greeted person panther\)", ran.err)
    same = daemon.run("goal", "say hello to everybody", "--yes", "--json").ok().json
    assert same["understood"]["by"] == ["interpreter", "other"]
    daemon.pull("other")
    daemon.until("the other one is gone", lambda view: len(view["components"]) == 2)
