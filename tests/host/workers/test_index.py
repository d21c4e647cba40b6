"""The index and the plugin say the same, or the first differences are named by place."""

from __future__ import annotations

from nondum.host.workers.index import SHOWN, mismatches
from nondum.sdk.description import Behaviour, Label, PluginDescription

PLAIN = PluginDescription("guest", "1.0", behaviours=(Behaviour("do", "(do ?u - sensor)"),))


def test_equal_descriptions_agree() -> None:
    same = PluginDescription.parse(PLAIN.to_dict(), where="index")
    assert mismatches(PLAIN, same, "guest") == ()


def test_difference_is_named_by_place() -> None:
    said = PluginDescription("guest", "1.0", behaviours=(Behaviour("do", "(do ?u - base)"),))
    (problem,) = mismatches(PLAIN, said, "guest")
    assert problem.code == "INDEX_MISMATCH"
    assert "index.behaviours[0].action" in problem.message
    assert (problem.need, problem.have) == ("'(do ?u - sensor)'", "'(do ?u - base)'")


def test_missing_and_added_items_are_told() -> None:
    (gone,) = mismatches(PLAIN, PluginDescription("guest", "1.0"), "guest")
    (added,) = mismatches(PluginDescription("guest", "1.0"), PLAIN, "guest")
    assert gone.have == added.need == "nothing"


def test_many_differences_are_cut_short() -> None:
    labels = tuple(Label(f"o{number}", "words") for number in range(20))
    said = PluginDescription("guest", "1.0", labels=labels)
    assert len(mismatches(PluginDescription("guest", "1.0"), said, "guest")) == SHOWN
