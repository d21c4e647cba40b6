"""Extensions of the host: what ships is one of them, and a broken one ends nothing."""

from __future__ import annotations

import inspect
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from importlib_metadata import EntryPoint

from nondum.host.config.host_config import HostConfig
from nondum.host.config.parsing import parse
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.extension import hookspecs
from nondum.host.extension.hookspecs import Host, hookimpl
from nondum.host.extension.loading import DEFAULT_PLUGINS, Extensions
from nondum.host.people.feedback.hook import Hook

GROUP = hookspecs.PROJECT


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> Callable[..., EntryPoint]:
    """Makes an importable module of functions, and the entry point that names it."""

    def made(name: str, **functions: Any) -> EntryPoint:
        found = types.ModuleType(name)
        found.__dict__.update(functions)
        monkeypatch.setitem(sys.modules, name, found)
        return EntryPoint(name=name, value=name, group=GROUP)

    return made


def host(folder: Path, text: str = "") -> Host:
    async def say(text: str) -> None:
        raise AssertionError(text)

    return Host(
        parse(text, "host.toml", HostConfig()), folder, lambda: Snapshot("spot", 1), say, list
    )


@hookimpl
def planners() -> dict[str, str]:
    return {"mine": "mine:Planner"}


def test_what_ships_is_made_of_extensions(tmp_path: Path) -> None:
    shipped = Extensions([])
    assert {name for name, _ in shipped.manager.list_name_plugin()} == set(DEFAULT_PLUGINS)
    assert "native" in dict(shipped.asked("planners"))
    outputs = [*shipped.asked("feedback_outputs", host=host(tmp_path, HOOK))]
    assert [type(output) for output in outputs] == [Hook]
    assert list(dict(shipped.asked("fleets", config=HostConfig()))) == ["mesh"]


HOOK = '[feedback]\nhook = ["/bin/true"]\nspeak = false\n'


def test_extension_adds_to_what_ships(module: Callable[..., EntryPoint]) -> None:
    extensions = Extensions([module("mine", planners=planners)])
    assert dict(extensions.asked("planners"))["mine"] == "mine:Planner"
    assert not extensions.problems


@hookimpl
def config_keys() -> tuple[str, ...]:
    return ("feedback.lamps",)


@pytest.mark.parametrize(
    ("lines", "plugins", "missing"),
    [
        ("", {}, []),
        ('lamps = ["a"]\nplayer = ["/b"]', {}, ["feedback.lamps", "feedback.player"]),
        ('lamps = ["a"]\nplayer = ["/b"]', {"config_keys": config_keys}, ["feedback.player"]),
        ('lamps = ["a"]', {"config_keys": config_keys}, []),
    ],
    ids=["not set", "none is installed", "one is installed for one of them", "one is installed"],
)
def test_key_that_lacks_its_extension_is_told(
    lines: str,
    plugins: dict[str, Any],
    missing: list[str],
    module: Callable[..., EntryPoint],
    tmp_path: Path,
) -> None:
    extensions = Extensions([module("mine", **plugins)])
    extensions.note_missing(host(tmp_path, f"[feedback]\n{lines}\n").config)
    told = [(p.code, p.where) for p in extensions.problems]
    assert told == [("EXTENSION_MISSING", key) for key in missing]


@pytest.mark.parametrize("hook", hookspecs.HOOKS)
def test_extension_that_raises_is_told_and_left_out(
    hook: str, module: Callable[..., EntryPoint], tmp_path: Path
) -> None:
    def mistaken() -> None:
        raise ZeroDivisionError("a mistake")

    extensions = Extensions([module("broken", **{hook: hookimpl(mistaken)})])
    every = {"host": host(tmp_path), "config": HostConfig()}
    arguments = {
        name: every[name] for name in inspect.signature(getattr(hookspecs, hook)).parameters
    }
    shipped = [*Extensions([]).asked(hook, **arguments)]
    assert len([*extensions.asked(hook, **arguments)]) == len(shipped)
    assert [(p.code, p.where) for p in extensions.problems] == [("EXTENSION_BROKEN", "broken")]


def test_extension_that_cannot_be_imported_is_told_and_left_out() -> None:
    extensions = Extensions([EntryPoint(name="gone", value="no_such_module", group=GROUP)])
    assert [(p.code, p.where) for p in extensions.problems] == [("EXTENSION_BROKEN", "gone")]
    assert "native" in dict(extensions.asked("planners"))


def test_extension_with_a_hook_that_there_is_not_is_told_and_left_out(
    module: Callable[..., EntryPoint],
) -> None:
    @hookimpl
    def plannerz() -> dict[str, str]:
        return {}

    extensions = Extensions([module("misspelt", plannerz=plannerz, planners=planners)])
    assert [(p.code, p.where) for p in extensions.problems] == [("EXTENSION_BROKEN", "misspelt")]
    assert "mine" not in dict(extensions.asked("planners"))
