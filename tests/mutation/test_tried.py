"""A step is tried again when its module or a guard's file has changed, on whatever machine."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.mutation.guards import GUARDS
from tests.mutation.page import Key
from tests.mutation.tried import Tried

MODULE = "wheelhouse/nondum/wheelhouse/trust/wire.py"
STEPS = (Key(MODULE, "a", 1), Key(MODULE, "b", 1))
GUARD = f"{GUARDS[MODULE][0]}::test_it"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A checkout with that module and its guards."""
    for name in (MODULE, *GUARDS[MODULE]):
        file = tmp_path / "checkout" / name
        file.parent.mkdir(parents=True)
        file.write_text("1", encoding="utf-8")
    return tmp_path / "checkout"


def tried_on(machine: str, root: Path) -> Tried:
    """What a machine of that name knows; the checkout brings what is kept in the repository."""
    folder = root.parent / machine
    return Tried(folder / "round", folder / "keep", root, STEPS, root / "guarded.json")


def test_step_is_due_until_it_is_tried(root: Path) -> None:
    tried = tried_on("one", root)
    assert [tried.is_due(step) for step in STEPS] == [True, True]
    tried.add(STEPS[0], GUARD)
    assert [tried_on("one", root).is_due(step) for step in STEPS] == [False, True]
    assert [tried_on("two", root).is_due(step) for step in STEPS] == [True, True]


def test_module_of_guarded_steps_is_due_on_no_machine(root: Path) -> None:
    for step in STEPS:
        tried_on("one", root).add(step, GUARD)
    progress = tried_on("two", root).progress
    assert progress.is_whole
    assert not progress.failed


def test_step_without_a_guard_fails_here_and_is_tried_elsewhere(root: Path) -> None:
    tried = tried_on("one", root)
    tried.add(STEPS[0], GUARD)
    tried.add(STEPS[1], "")
    assert [name.partition(": ")[2] for name in tried.progress.failed] == ["b (1)"]
    assert not tried_on("two", root).progress.done


@pytest.mark.parametrize("changed", [MODULE, GUARDS[MODULE][0]])
def test_all_steps_are_due_once_something_has_changed(root: Path, changed: str) -> None:
    for step in STEPS:
        tried_on("one", root).add(step, GUARD)
    (root / changed).write_text("2", encoding="utf-8")
    for machine in ("one", "two"):
        assert not tried_on(machine, root).progress.done


def test_all_steps_are_due_once_another_test_of_the_same_file_is_a_guard(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(GUARDS, MODULE, (GUARD,))
    for step in STEPS:
        tried_on("one", root).add(step, GUARD)
    assert not [step for step in STEPS if tried_on("one", root).is_due(step)]
    monkeypatch.setitem(GUARDS, MODULE, (GUARD, f"{GUARD}_too"))
    assert all(tried_on("one", root).is_due(step) for step in STEPS)
