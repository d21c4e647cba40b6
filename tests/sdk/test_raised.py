"""An exception is reported with the plugin author's own line, whichever library raised it."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk.raised import raised

PLUGIN = """
import json
from gps_library import parse
from nondum.sdk import Output

def of_a_library():
    parse("x")

def of_python():
    json.loads("{")
"""
LIBRARY = "\ndef parse(text):\n    return int(text)\n"


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    site = tmp_path / "site-packages"
    (site / "gps").mkdir(parents=True)
    (site / "gps/__init__.py").write_text("", encoding="utf-8")
    (site / "gps/plugin.py").write_text(PLUGIN, encoding="utf-8")
    (site / "gps_library.py").write_text(LIBRARY, encoding="utf-8")
    monkeypatch.syspath_prepend(site)
    yield importlib.import_module("gps.plugin")
    for name in ("gps", "gps.plugin", "gps_library"):
        del sys.modules[name]


@pytest.mark.parametrize(("name", "line"), [("of_a_library", 7), ("of_python", 10)])
def test_the_line_is_the_plugins_own(plugin: Any, name: str, line: int) -> None:
    function: Callable[[], None] = getattr(plugin, name)
    with pytest.raises(ValueError) as caught:
        function()
    problem = raised("BEHAVIOUR_RAISED", caught.value, function)
    assert problem.where == f"gps/plugin.py:{line}"
    assert problem.message.startswith(type(caught.value).__name__)


def test_an_exception_that_has_lost_its_way_has_no_line() -> None:
    assert raised("BEHAVIOUR_RAISED", ValueError("x"), print).where == ""
