"""Announcements are kept, in order, and within bounds, whatever their subject."""

from __future__ import annotations

from dataclasses import replace

from tests.host.lifecycle.states import component
from tests.kit.golden import Golden

from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.announcements import (
    MAX_CHARACTERS,
    MAX_SENTENCES,
    People,
    kept_out,
    recomposed,
)
from nondum.host.mind.composition import compose
from nondum.sdk.errors import Problem


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


def test_component_that_waits_for_its_device_is_not_said_to_be_able_to_do_anything(
    golden: Golden,
) -> None:
    waiting = component("eye", need="0403")
    served = replace(waiting, devices=(replace(waiting.devices[0], device="usb:1-4"),))
    before, after = (
        compose(Snapshot("spot", revision, components=(one,)))
        for revision, one in enumerate((waiting, served))
    )
    [waits] = recomposed(None, before)
    golden.check("a component waits for its device", waits)
    [ready] = recomposed(before, after)
    golden.check("the device is there", ready)
    assert recomposed(after, before) == [waits]


def test_what_was_told_of_a_component_that_is_kept_out_is_over_when_it_is_not_any_more() -> None:
    people, wrong, worse = (
        People(lambda: 5.0),
        Problem("PDDL_UNKNOWN", "a"),
        Problem("PDDL_UNKNOWN", "b"),
    )
    kept_out(people, {}, {"eye": (wrong,), "cam": (wrong,)})
    kept_out(people, {"eye": (wrong,), "cam": (wrong,)}, {"eye": (worse,), "cam": (wrong,)})
    assert [told.about for told in people if not told.is_over] == ["kept out cam", "kept out eye"]
    kept_out(people, {"eye": (worse,), "cam": (wrong,)}, {"eye": (worse,)})
    assert [told.about for told in people if not told.is_over] == ["kept out eye"]
    kept_out(people, {"eye": (worse,)}, {})
    assert all(told.is_over for told in people)
