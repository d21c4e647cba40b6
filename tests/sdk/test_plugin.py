"""Plugins are found, described, and told all that is wrong with them."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from tests.kit.golden import Golden
from tests.sdk import greeter

from nondum.sdk import (
    Context,
    Output,
    PluginDescription,
    TickedBehaviour,
    Unit,
    WorkerFailed,
    behaviour,
    condition,
    describe,
    hookimpl,
    load,
)


def module(**members: Any) -> ModuleType:
    made = ModuleType("a_plugin", "Does a thing.\n\nAnd more.")
    vars(made).update(members)
    return made


def test_module_describes_itself() -> None:
    described = describe(load("tests.sdk.greeter", "Nondum_Greeter"))
    assert described.name == "nondum-greeter"
    assert described.version == "0"
    assert described.summary == "A plugin with one of everything, for the SDK's own tests."
    by_name = {b.name: b for b in described.behaviours}
    assert list(by_name) == sorted(by_name)
    assert by_name["greet"].phrases == ("greet {h}",)
    assert by_name["greet"].doc == "Say hello once."
    assert by_name["sing"].lasting
    assert described.conditions[0].predicates == ("raining", "bearing-known")
    assert described.fragments[0].text == greeter.DOMAIN


def test_description_survives_an_index() -> None:
    described = describe(load(greeter))
    plain = json.loads(json.dumps(described.to_dict()))
    assert PluginDescription.parse(plain, where="index.json") == described


def test_class_is_made_and_its_methods_found() -> None:
    class Plugin:
        """A class of a plugin."""

        @property
        def trap(self) -> int:
            raise AssertionError("describing runs no property")

        @hookimpl
        def describe(self) -> dict[str, str]:
            return {"summary": "Said by the hook."}

        @behaviour("move", action="(move ?u - base)")
        async def move(self, ctx: Context, u: str) -> None: ...

    described = describe(load(Plugin, "mover"))
    assert described.summary == "Said by the hook."
    assert [b.name for b in described.behaviours] == ["move"]


def test_hook_may_name_the_behaviours() -> None:
    @behaviour("one", action="(one ?u - base)")
    async def one(ctx: Context, u: str) -> None: ...

    @behaviour("two", action="(two ?u - base)")
    async def two(ctx: Context, u: str) -> None: ...

    @hookimpl
    def behaviours() -> list[Any]:
        return [one]

    described = describe(load(module(one=one, two=two, behaviours=behaviours)))
    assert [b.name for b in described.behaviours] == ["one"]


def test_marked_functions_stay_callable() -> None:
    @condition("c", predicates=("p",))
    @behaviour("b", action="(b ?u - base)")
    def both(ctx: Context, u: str) -> str:
        return u

    assert both(None, "x") == "x"  # type: ignore[arg-type]  # it does not look at its context


def problems_of(plugin: object) -> list[str]:
    with pytest.raises(WorkerFailed) as caught:
        describe(load(plugin))
    return [str(problem) for problem in caught.value.problems]


def test_everything_wrong_is_told_at_once(golden: Golden) -> None:
    @behaviour("swapped", action="(swapped ?u - base ?h - host)")
    async def swapped(ctx: Context, h: str, u: str) -> None: ...

    @behaviour("unreadable", action="unreadable ?u")
    async def unreadable(ctx: Context, u: str) -> None: ...

    @behaviour("no-initialise", action="(no-initialise ?u - base)")
    class NoInitialise(TickedBehaviour):
        def initialise(self, ctx: Context) -> None: ...

    @hookimpl
    def units() -> list[Unit]:
        outputs = (Output("o", "text"), Output("o", "text"))
        return [Unit("a", "base"), Unit("a", "base", outputs), Unit("Big__Name", "base")]

    told = problems_of(
        module(swapped=swapped, unreadable=unreadable, ticked=NoInitialise, units=units)
    )
    assert len(told) == 6
    line = swapped.__code__.co_firstlineno
    assert any(f"test_plugin.py:{line} behaviour 'swapped'" in one for one in told)
    golden.check(
        "six mistakes at once", "\n".join(re.sub(r"\S+\.py:\d+", "LINE", one) for one in told)
    )


def raising() -> None:
    raise RuntimeError("not today")


@pytest.mark.parametrize(
    ("hook", "answer", "told"),
    [
        ("units", raising, "HOOK_FAILED"),
        ("describe", raising, "hook 'describe' raised: RuntimeError: not today"),
        ("describe", lambda: ["summary"], "hook 'describe' gives no table of texts"),
        ("units", lambda: ["head"], "hook 'units' gave something that is no Unit"),
        ("fragments", lambda: ["(define …)"], "DESCRIPTION_INVALID"),
        ("labels", lambda: 3, "DESCRIPTION_INVALID"),
        ("behaviours", lambda: [raising], "carries no mark"),
    ],
)
def test_wrong_hooks_are_told(hook: str, answer: Any, told: str) -> None:
    def answers() -> Any:
        return answer()

    answers.__name__ = hook
    assert told in "\n".join(problems_of(module(**{hook: hookimpl(answers)})))


def test_unknown_hook_is_a_mistake() -> None:
    @hookimpl
    def unitz() -> list[Unit]:
        return []

    with pytest.raises(WorkerFailed, match="unitz") as caught:
        load(module(unitz=unitz))
    assert caught.value.code == "HOOK_UNKNOWN"


def test_two_behaviours_of_one_name_are_refused(golden: Golden) -> None:
    def make() -> Any:
        @behaviour("same", action="(same ?u - base)")
        async def same(ctx: Context, u: str) -> None: ...

        return same

    told = problems_of(module(a=make(), b=make()))[0]
    golden.check("two behaviours of one name", re.sub(r"\S+\.py:\d+", "LINE", told))


@pytest.mark.parametrize(
    ("target", "told"),
    [
        ("no_such_module_anywhere", "ModuleNotFoundError"),
        ("tests.sdk.greeter:Nothing", "AttributeError"),
        ("", "ValueError"),
    ],
)
def test_failed_import_is_told(target: str, told: str) -> None:
    with pytest.raises(WorkerFailed, match=told) as caught:
        load(target)
    assert caught.value.code == "IMPORT_FAILED"


def test_missing_dependency_is_told_with_where_it_is_to_be_declared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "needs_another.py").write_text("import no_such_module\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(WorkerFailed) as caught:
        load("needs_another")
    (problem,) = caught.value.problems
    assert problem.where.endswith("needs_another.py:1")
    assert "'no_such_module' to `dependencies`" in problem.fix


@pytest.mark.parametrize("target", ["no_such_module", "no_such_module.plugin", "tests.no_such:It"])
def test_plugin_that_is_not_there_itself_is_no_missing_dependency(target: str) -> None:
    """Its entry point is misspelt, or its tests run where it is not installed."""
    with pytest.raises(WorkerFailed) as caught:
        load(target)
    (problem,) = caught.value.problems
    assert (problem.code, problem.where) == ("IMPORT_FAILED", "")
    assert "dependencies" not in problem.fix
    assert "entry point" in problem.fix


def test_class_that_cannot_be_made_is_told() -> None:
    class Needy:
        def __init__(self, what: str) -> None: ...

    with pytest.raises(WorkerFailed, match=r"TypeError.*'what'") as caught:
        load(Needy)
    assert caught.value.code == "IMPORT_FAILED"
