"""The SDK's face: what it exports, what it costs to import, and that its hooks are documented."""

from __future__ import annotations

import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import nondum.sdk
from nondum.sdk import describe, hooks, load
from nondum.sdk.bench import WorkerFactory

ROOT = Path(__file__).parent.parent.parent
DOCS = ROOT / "docs" / "sdk.md"
README = ROOT / "plugins" / "sdk" / "README.md"


def test_exports_are_there() -> None:
    assert len(set(nondum.sdk.__all__)) == len(nondum.sdk.__all__)
    assert set(nondum.sdk._HOME) == set(nondum.sdk.__all__)
    for name, home in nondum.sdk._HOME.items():
        defined = getattr(importlib.import_module(f"nondum.sdk.{home}"), name)
        assert getattr(nondum.sdk, name) is defined
    assert set(nondum.sdk.__all__) <= set(dir(nondum.sdk))


def test_typed_imports_match_the_lazy_ones() -> None:
    source = inspect.getsource(nondum.sdk)
    typed = source.partition("if TYPE_CHECKING:")[2].partition("_HOME")[0]
    names = re.findall(r"from nondum\.sdk\.(\w+) import (\([^)]*\)|[^\n]+)", typed)
    found = {name: home for home, listed in names for name in re.findall(r"\w+", listed)}
    assert found == nondum.sdk._HOME


def test_unknown_names_are_attribute_errors() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Nothing'"):
        _ = nondum.sdk.Nothing  # type: ignore[attr-defined]  # that is what is tested


@pytest.mark.parametrize("module", ["nondum.sdk.errors", "nondum.sdk.testing"])
def test_cheap_modules_stay_cheap(module: str) -> None:
    costly = ["msgpack", "nondum.sdk.link", "nondum.sdk.messages", "numpy"]
    check = f"import sys, pytest, {module}; print({{*{costly}}} & {{*sys.modules}})"
    ran = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "set()"


@pytest.mark.parametrize("hook", hooks.DESCRIBING + hooks.ACTING)
def test_hooks_are_documented_with_their_signature(hook: str) -> None:
    specification = getattr(hooks, hook)
    parameters = ", ".join(inspect.signature(specification).parameters)
    assert f"### `{hook}({parameters})`" in DOCS.read_text(encoding="utf-8")
    assert inspect.getdoc(specification)


def test_all_specifications_are_listed() -> None:
    marked = {n for n, f in vars(hooks).items() if hasattr(f, f"{hooks.PROJECT}_spec")}
    assert marked == {*hooks.DESCRIBING, *hooks.ACTING}


def python_blocks(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def test_readme_plugin_works(worker: WorkerFactory) -> None:
    plugin, test = python_blocks(README)
    module = ModuleType("blinker")
    exec(plugin, vars(module))
    sys.modules["blinker"] = module
    try:
        written: dict[str, Any] = {}
        exec(test, written)
        written["test_blinks"](worker)
    finally:
        del sys.modules["blinker"]


def test_front_page_shows_the_same_plugin() -> None:
    assert python_blocks(ROOT / "README.md") == python_blocks(README)[:1]


@pytest.mark.parametrize("block", python_blocks(DOCS))
def test_documented_code_can_be_loaded(block: str) -> None:
    module = ModuleType("documented")
    exec(block, vars(module))
    describe(load(module))
