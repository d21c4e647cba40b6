"""How behaviours went down: what passes for one decision that was obeyed, and what must not."""

from __future__ import annotations

from typing import Any

import pytest
from demo.fall import HALTED_S, Fall

PARTS = ("camera", "detector", "tracker", "base")
ACTIONS = [f"{part}.work" for part in PARTS]
LEFT = PARTS[1:]
"""Components that are still there."""

Row = dict[str, Any]


def row(event: str, subject: str = "", at_s: float = 10.0, **detail: object) -> Row:
    return {"event": event, "subject": subject, "monotonic": at_s, "detail": detail}


def halts(*actions: str, lost: tuple[str, ...] = ()) -> Row:
    return row(
        "BehavioursHalted",
        tick=7,
        halted=dict.fromkeys(actions, "its guard is broken"),
        lost=dict.fromkeys(lost, "its component is gone"),
    )


def ended(component: str, *, after_s: float = 0.02, outcome: str = "HALTED") -> Row:
    return row("BehaviourEnded", component, 10.0 + after_s, outcome=outcome)


def journal(**changed: Row | None) -> list[Row]:
    """One in which all is as it should be, but for rows that are replaced or left out."""
    rows: dict[str, Row | None] = {
        "withdrawn": row("PayloadWithdrawn"),
        "halts": halts(*ACTIONS[1:], lost=(ACTIONS[0],)),
        **{part: ended(part) for part in PARTS},
        "missing": row("PlanMissing"),
    }
    return [found for found in (rows | changed).values() if found is not None]


def faults(rows: list[Row]) -> list[str]:
    return list(Fall.of(rows).faults(ACTIONS, LEFT))


def test_one_decision_that_is_obeyed_has_no_faults() -> None:
    assert faults(journal()) == []
    assert Fall.of(journal()).took_s == pytest.approx(0.02)


def test_nothing_halted_is_a_fault() -> None:
    silent: dict[str, Row | None] = dict.fromkeys(("halts", *PARTS))
    assert faults(journal(**silent))[0] == "nothing was halted"


@pytest.mark.parametrize("part", LEFT)
def test_skipped_halt_is_a_fault(part: str) -> None:
    others = [action for action in ACTIONS[1:] if action != f"{part}.work"]
    rows = journal(halts=halts(*others, lost=(ACTIONS[0],)), **{part: None})
    assert faults(rows) == [f"{part}.work was not halted", f"what {part} did has not ended"]


def test_camera_that_was_not_seen_to_go_is_a_fault() -> None:
    assert faults(journal(halts=halts(*ACTIONS[1:]))) == ["camera.work was not halted"]


def test_halts_in_two_ticks_are_a_fault() -> None:
    rows = journal(halts=halts(*ACTIONS[1:3], lost=(ACTIONS[0],)), late=halts(ACTIONS[3]))
    assert faults(rows) == ["base.work was halted in a later tick"]


def test_stream_that_stopped_flowing_a_moment_before_the_loss_is_no_fault() -> None:
    before = halts(ACTIONS[3])
    rows = journal(halts=before, loss=halts(*ACTIONS[1:3], lost=(ACTIONS[0],)))
    assert faults(rows) == []


def test_halt_after_the_loss_is_a_fault_whatever_was_halted_before() -> None:
    loss, late = halts(ACTIONS[1], lost=(ACTIONS[0],)), halts(ACTIONS[2])
    rows = journal(halts=halts(ACTIONS[3]), loss=loss, late=late)
    assert faults(rows) == ["tracker.work was halted in a later tick"]


def test_time_to_end_counts_from_the_tick_in_which_each_was_asked() -> None:
    before = row("BehavioursHalted", at_s=9.0, tick=6, halted={ACTIONS[3]: "no stream"}, lost={})
    rows = journal(halts=before, loss=halts(*ACTIONS[1:3], lost=(ACTIONS[0],)))
    assert faults(rows) == ["what base did took 1.0 s to end"]


def test_what_did_not_need_it_may_go_later() -> None:
    rows = journal(halts=halts(*ACTIONS[1:3], lost=(ACTIONS[0],)), late=halts(ACTIONS[3]))
    assert list(Fall.of(rows).faults(ACTIONS[:3], LEFT)) == []


@pytest.mark.parametrize(
    ("end", "fault"),
    [
        (None, "has not ended"),
        (ended("tracker", after_s=HALTED_S + 0.5), "took 1.5 s to end"),
        (ended("tracker", outcome="FAILED"), "failed"),
    ],
    ids=["never", "late", "failed"],
)
def test_behaviour_that_does_not_obey_is_a_fault(end: Row | None, fault: str) -> None:
    assert faults(journal(tracker=end)) == [f"what tracker did {fault}"]


def test_worker_that_had_to_be_ended_is_a_fault() -> None:
    rows = journal(exit=row("WorkerExited", "tracker", reason="WORKER_EXITED"))
    assert faults(rows) == ["the worker of tracker ended"]
