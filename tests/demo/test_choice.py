"""Who was chosen over whom, read off a tree."""

from __future__ import annotations

from typing import Any

from demo.choice import Choice, choices


def node(*children: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"name": "node", "children": list(children), **more}


def step(component: str, *others: str) -> dict[str, Any]:
    rows = [{"component": other, "cost": 60} for other in others]
    return node(step={"component": component, "chosen": {"why": "it is", "instead_of": rows}})


def test_only_steps_with_alternatives_are_choices() -> None:
    tree = node(node(step("camera"), step("quick", "slow", "slower")), step("base"))
    assert list(choices(tree)) == [Choice("quick", ("slow", "slower"), "it is")]


def test_a_choice_is_said_with_its_reason() -> None:
    assert str(Choice("quick", ("slow",), "the cheapest")) == "quick instead of slow (the cheapest)"
