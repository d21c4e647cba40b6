"""The documentation lists every step of verification with a test that guards it."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from tests.mutation import page
from tests.mutation.guards import GUARDS
from tests.mutation.page import Key
from tests.mutation.steps import steps_in, steps_of

ROOT = Path(__file__).parents[2]

SOURCE = """\
def check(size, kind, name):
    if size > 10 or kind is None:
        raise Refused("too long")
    if name:
        count = len(name)
        yield Problem("NAME", f"{count}")
    match kind:
        case "dür" if not name:
            return "has no name"
        case _:
            size = 3
    if size == 3:
        size = 4
"""


def test_every_step_of_the_modules_on_the_page_has_a_test_that_is_there() -> None:
    listed = page.read(page.PAGE.read_text(encoding="utf-8"))
    modules = tuple({key.module for key in listed} & GUARDS.keys())
    assert modules
    missing = page.keyed(steps_in(ROOT, modules)).keys() - listed.keys()
    assert not missing, "run `python -m tests.mutation`: the page lacks what is refused here"
    assert page.MISSING not in listed.values()
    files = {guard.partition("::")[0] for guard in listed.values()}
    assert [file for file in sorted(files) if not (ROOT / file).is_file()] == []


def test_each_condition_that_suffices_is_a_step() -> None:
    steps = steps_of("m.py", SOURCE)
    assert [step.condition for step in steps] == ["size > 10", "kind is None", "name", "not name"]


def test_a_step_that_is_removed_leaves_all_else() -> None:
    for step in steps_of("m.py", SOURCE):
        without = step.removed(SOURCE)
        assert without.count("False") == 1
        assert without.replace("False", step.condition) == SOURCE


KEYS = st.builds(Key, st.just("a/b.py"), st.text("ab |`\\", min_size=1).map(str.strip), st.just(1))


@given(st.dictionaries(KEYS.filter(lambda key: key.condition), st.just("tests/t.py::test_a")))
def test_the_page_is_read_as_it_was_written(guards: dict[Key, str]) -> None:
    assert page.read(page.written(guards)) == guards
