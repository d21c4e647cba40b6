"""The front page is short, and its plugin of ten lines is whole: hosts plan with it."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import phrasebook
from nondum.sdk import describe, load
from nondum.sdk.bench import WorkerFactory

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "README.md").read_text(encoding="utf-8")
MAX_WORDS = 900
MAX_LINES = 10


@pytest.fixture
def source() -> str:
    """The page's one block of Python."""
    (found,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    return str(found)


@pytest.fixture
def plugin(source: str) -> ModuleType:
    module = ModuleType("blinker")
    exec(compile(source, "README.md", "exec"), vars(module))  # the page's own code
    return module


def test_page_is_short() -> None:
    assert len(PAGE.split()) <= MAX_WORDS


def test_plugin_has_ten_lines(source: str) -> None:
    assert sum(bool(line.strip()) for line in source.splitlines()) <= MAX_LINES


def test_plugin_works_on_the_bench(plugin: ModuleType, worker: WorkerFactory) -> None:
    bench = worker(plugin)
    bench.behave("blink", u="lamp", h="robot").assert_succeeded()
    assert bench.logs


def test_host_plans_with_the_plugin_and_understands_the_goal_of_the_page(
    plugin: ModuleType,
) -> None:
    (words,) = re.findall(r'`nondum goal "(.+?)"`', PAGE)
    description = describe(load(plugin, "blinker"))
    brought = Contribution.from_description(description, host="rover", component="blinker")
    merged = merge((brought,), "rover")
    assert not merged.quarantined
    assert str(phrasebook((brought,), merged).goal(words)) == "achieve (greeted rover)"
    assert merged.domain.actions["blinker.blink"].behaviour == "blink"
