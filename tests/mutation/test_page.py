"""The documentation lists every step of verification with a test that guards it."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.mutation import page
from tests.mutation.guards import ASIDE, FOLDERS, GUARDS, SPARED
from tests.mutation.page import Key
from tests.mutation.steps import TABLES, steps_in, steps_of

ROOT = Path(__file__).parents[2]


def test_the_page_has_every_step_and_a_test_that_guards_it() -> None:
    listed = page.read(page.PAGE.read_text(encoding="utf-8"))
    steps = page.keyed(steps_in(ROOT, tuple(GUARDS)))
    assert listed.keys() == steps.keys(), "run `python -m tests.mutation`"
    assert page.MISSING not in listed.values()
    spared = {key: why for key, why in listed.items() if key[:2] in SPARED}
    assert spared == {key: page.spared(SPARED[key[:2]]) for key in spared}
    assert {key[:2] for key in spared} == SPARED.keys()
    guards = {guard for key, guard in listed.items() if key not in spared}
    for guard in sorted({guard.partition("[")[0] for guard in guards}):
        file, *_, test = guard.split("::")
        assert f"def {test}(" in (ROOT / file).read_text(encoding="utf-8"), guard


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_module_that_refuses_anything_is_left_out(folder: str) -> None:
    for path in sorted((ROOT / folder).rglob("*.py")):
        module = path.relative_to(ROOT).as_posix()
        if "template" not in path.parts:
            refuses = bool(steps_of(module, path.read_text(encoding="utf-8")))
            assert refuses == (module in GUARDS.keys() | ASIDE.keys()), module


def test_what_stands_aside_is_not_guarded() -> None:
    assert not GUARDS.keys() & ASIDE.keys()


@pytest.mark.parametrize(
    ("source", "conditions"),
    [
        ("if a > 1 or not b:\n    raise Refused()", ["a > 1", "not b"]),
        ("if not 0 < a <= 9:\n    raise Refused()", ["not 0 < a", "not a <= 9"]),
        ("if not (a and b):\n    raise Refused()", ["not (a)", "not (b)"]),
        ("if a:\n    text = f'{a}'\n    yield Problem('A', text)", ["a"]),
        ("if flaw := one(a) or two(a):\n    yield Problem('A', flaw)", ["one(a)", "two(a)"]),
        ("if a:\n    close(b)\n    raise Refused()", ["a"]),
        ("if a:\n    b = 1", []),
        ("if a:\n    raise OSError()", []),
        ("if a:\n    b = 1\nelse:\n    raise Refused()", ["not (a)"]),
        ("def f():\n    if a and b:\n        return 1\n    raise No()", ["not (a)", "not (b)"]),
        ("def flaw(a):\n    if a:\n        return 'is none'", ["a"]),
        ("def name(a):\n    if a:\n        return 'A'", []),
        ("def is_good(a) -> bool:\n    if a:\n        return False\n    return b == 1",
         ["a", "not (b == 1)"]),
        ("match a:\n    case 1 if not b:\n        raise Refused()", ["not b"]),
        ("match a:\n    case _:\n        raise Refused()", ["case _"]),
        ("try:\n    a()\nexcept ValueError:\n    raise Refused()", ["except ValueError"]),
        ("try:\n    a()\nexcept (OSError, TimeoutError):\n    raise Refused()", []),
        ("for one in found:\n    yield Problem('A', one)", ["for … in found"]),
        ("told = [Problem('A', one) for one in found if one > 1]", ["one > 1"]),
        ("problems.extend(_size_flaws(a))", ["_size_flaws(a)"]),
        ("check_signed(a)", ["check_signed(a)"]),
        ("refuse_if_any(a.problems())", ["refuse_if_any(a.problems())"]),
        ("reader.end()", ["reader.end()"]),
        ("def gone() -> Problem: ...\nif a:\n    yield gone()", ["a"]),
        ("def judge():\n    if a:\n        return Reason.REVOKED", ["a"]),
        ("def judge():\n    return None if a else Reason.REVOKED", ["not (a)"]),
    ],
)  # fmt: skip
def test_a_step_is_what_leads_to_a_refusal(source: str, conditions: list[str]) -> None:
    steps = steps_of("m.py", source)
    assert [step.condition for step in steps] == conditions
    for step in steps:
        without = step.removed(source)
        ast.parse(without)
        assert without[: step.start] == source[: step.start]
        assert without.endswith(source[step.end :])
        assert without != source


def test_each_row_of_a_table_of_refusals_is_a_step() -> None:
    source = 'GROUPS: M = {"a": _all("x", *("y", "z")), "b": (Rule("w", 1, equal=(5,)),)}'
    module = next(module for module, tables in TABLES.items() if "GROUPS" in tables)
    assert [step.condition for step in steps_of(module, source)] == [
        *("'a'", '"x"', '"y"', '"z"', "'b'", 'Rule("w", 1, equal=(5,))')
    ]
    for step in steps_of(module, source):
        ast.parse(step.removed(source))
    assert steps_of("m.py", source) == ()


def test_steps_are_found_behind_letters_of_many_bytes() -> None:
    source = 'said = "dür"\nif "dür" in a or "é" in a:\n    raise Refused()'
    assert [step.condition for step in steps_of("m.py", source)] == ['"dür" in a', '"é" in a']


KEYS = st.builds(Key, st.just("a/b.py"), st.text("ab |`\\", min_size=1).map(str.strip), st.just(1))


@given(st.dictionaries(KEYS.filter(lambda key: key.condition), st.just("tests/t.py::test_a")))
def test_the_page_is_read_as_it_was_written(guards: dict[Key, str]) -> None:
    assert page.read(page.written(guards)) == guards
