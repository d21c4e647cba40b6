"""Fragments with disjunctions, quantifiers, conditional effects and rules move a real host."""

from __future__ import annotations

import pytest
from tests.daemon.plugins import attic, lamps
from tests.kit.running_host import READY_S, RunningHost

pytestmark = pytest.mark.daemon


def test_goal_that_follows_from_a_rule_is_reached(host: RunningHost) -> None:
    host.bring("lamps", lamps())
    goal = host.want("(bright self)", kind="achieve")
    host.until_goal(goal, "reached")
    assert {"lit hall", "lit kitchen"} <= host.facts().keys()


def test_quantifier_speaks_of_rooms_that_come_later(host: RunningHost) -> None:
    host.bring("lamps", lamps())
    goal = host.want("(bright self)")
    host.until_goal(goal, "holds")
    host.bring("attic", attic())
    host.until("the attic is lit", lambda _: "lit attic" in host.facts(), timeout_s=READY_S)
    host.until_goal(goal, "holds")
    host.pull("attic")
    host.until_gone("attic")
    host.until_goal(goal, "holds")


def test_conditional_effect_undoes_what_it_did(host: RunningHost) -> None:
    host.bring("lamps", lamps())
    host.until_goal(host.want("(lit hall)", kind="achieve"), "reached")
    host.until_goal(host.want("(not (lit hall))", kind="achieve"), "reached")
    assert "lit hall" not in host.facts()


def test_disjunctive_goal_is_reached_one_way(host: RunningHost) -> None:
    host.bring("lamps", lamps())
    goal = host.want("(exists (?r - room) (lit ?r))", kind="achieve")
    host.until_goal(goal, "reached")
    assert sum(fact.startswith("lit ") for fact in host.facts()) == 1


def test_what_follows_is_told_with_its_rule(host: RunningHost) -> None:
    host.bring("lamps", lamps())
    host.until_goal(host.want("(bright self)", kind="achieve"), "reached")
    assert "bright spot" in host.facts()
    why = host.ask("fact", fact="(bright self)")
    assert why["holds"]
    assert [row["kind"] for row in why["for"]] == ["rule"]
    assert "lamps.pddl:5:14" in why["for"][0]["said"]
