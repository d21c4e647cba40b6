"""Advice calls payloads on the shelf what this host would call them."""

from __future__ import annotations

from typing import Any

import pytest

from nondum.cli.counsel import Surroundings
from nondum.cli.shelf import Shelved
from nondum.cli.shelf_names import ShelfNames
from nondum.planning.merge.given_names import GivenNames
from nondum.sdk.description import Behaviour, Fragment, PluginDescription, Unit

LAMP = """
(define (domain {word})
  (:predicates ({word} ?h - host))
  (:action shine :parameters (?u - light ?h - host) :precondition (ready ?u) :effect ({word} ?h)))
"""


def lamp(word: str, name: str = "lamp") -> PluginDescription:
    """A lamp whose light makes `word` true."""
    return PluginDescription(
        name,
        "1.0",
        behaviours=(Behaviour("shine", "(shine ?u - light ?h - host)"),),
        fragments=(Fragment(f"{word}.pddl", LAMP.format(word=word)),),
        units=(Unit("lamp", "light"),),
    )


def on_shelf(id: str, word: str, version: str = "1.0") -> Shelved:
    return Shelved(id, version, "/shelf", {"lamp": lamp(word)})


def told(**more: Any) -> dict[str, Any]:
    """What a daemon with the lamp of `org.x` tells."""
    here = {"component": "lamp", "payload": "org.x", "host": "spot", "rank": 1}
    return {
        "host": "spot",
        "components": [{**here, "description": lamp("lit").to_dict()}],
        "names": {},  # it has its own
        "facts": ["self spot", "ready spot__lamp__lamp"],
        "excluded": {},
        "seen": [],
        **more,
    }


def test_payload_with_the_component_id_of_one_here_helps() -> None:
    around = Surroundings.of(told(), [on_shelf("org.y", "warm")])
    [way] = around.counsel("(warm self)").advice.ways
    assert [(p.id, [c.component for c in p.contributions]) for p in way.payloads] == [
        ("org.y", ["lamp--org-y"])
    ]
    assert way.steps == ("lamp--org-y.shine spot__lamp--org-y__lamp spot",)
    assert not way.payloads[0].caveats


def test_two_such_payloads_help_together() -> None:
    around = Surroundings.of(told(), [on_shelf("org.y", "warm"), on_shelf("org.z", "dry")])
    [way] = around.counsel("(and (warm self) (dry self) (lit self))").advice.ways
    assert {p.id for p in way.payloads} == {"org.y", "org.z"}


def test_what_is_at_work_is_not_told_of_by_another_payloads_name() -> None:
    around = Surroundings.of(told(), [on_shelf("org.x", "lit", "0.9"), on_shelf("org.y", "warm")])
    assert [candidate.id for candidate in around.candidates] == ["org.y"]


def test_names_that_were_given_are_kept() -> None:
    kept = {"org.y": GivenNames({"lamp": "lamp"}, {"lamp": "lamp"})}
    names = ShelfNames(kept)
    [x, y] = names.called([on_shelf("org.x", "lit"), on_shelf("org.y", "warm")])
    assert [*x.components, *y.components] == ["lamp--org-x", "lamp"]


@pytest.mark.parametrize("word", ["lit", "warm"])
def test_releases_of_one_payload_have_one_name(word: str) -> None:
    names = ShelfNames.of({}, [("org.x", "lamp", lamp("lit"))])
    shelf = [on_shelf("org.y", word, "1.0"), on_shelf("org.y", word, "2.0")]
    assert len({name for one in names.called(shelf) for name in one.components}) == 1


@pytest.mark.parametrize(("word", "plugin"), [("lit", "lamp"), ("warm", "lamp--org-y")])
def test_plugins_share_a_name_if_they_say_the_same(word: str, plugin: str) -> None:
    [one] = ShelfNames.of({}, [("org.x", "lamp", lamp("lit"))]).called([on_shelf("org.y", word)])
    assert [description.name for description in one.components.values()] == [plugin]
