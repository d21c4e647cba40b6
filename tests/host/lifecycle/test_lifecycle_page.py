"""docs/lifecycle.md says what the tables say."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host.core.records.step import Step
from nondum.host.core.transitions import COMPONENT_TRANSITIONS, RECOVERY, diagram

PAGE = (Path(__file__).parents[3] / "docs/lifecycle.md").read_text(encoding="utf-8")


def test_diagram_is_the_table() -> None:
    assert f"```mermaid\n{diagram()}```" in PAGE


@pytest.mark.parametrize("step", Step)
def test_each_step_is_explained(step: Step) -> None:
    assert f"\n| {step.name} | " in PAGE


@pytest.mark.parametrize("step", RECOVERY)
def test_each_recovery_is_told(step: Step) -> None:
    assert f"\n| {step.name} | {RECOVERY[step].to.name} |" in PAGE


def test_component_states_are_told() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("|")]
    for (state, _), to in COMPONENT_TRANSITIONS.items():
        assert any(state.name in row and row.endswith(f"| {to.name} |") for row in rows)
