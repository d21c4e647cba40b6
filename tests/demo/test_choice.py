"""Which component was chosen instead of which others, read off a tree."""

from __future__ import annotations

from typing import Any

from demo.choice import Choice, choices


def node(*children: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"name": "node", "children": list(children), **more}


def step(component: str, *others: str) -> dict[str, Any]:
    rows = [{"component": other, "cost": 60 + n} for n, other in enumerate(others)]
    chosen = {"why": "it is", "cost": 30, "instead_of": rows}
    return node(step={"component": component, "chosen": chosen})


def test_only_steps_with_alternatives_are_choices() -> None:
    tree = node(node(step("camera"), step("quick", "slow", "slower")), step("base"))
    assert list(choices(tree)) == [Choice("quick", ("slow", "slower"), "it is", 30, 60)]


def test_a_choice_is_said_with_its_reason() -> None:
    choice = Choice("quick", ("slow",), "the cheapest", 30, 60)
    assert str(choice) == "quick instead of slow (the cheapest)"
