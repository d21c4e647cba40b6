"""What is told of a plugin's code that raised, or does not return: where its author has to look."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable, Coroutine
from pathlib import Path
from types import FrameType
from typing import Any

from nondum.sdk.errors import Problem

MAX_TEXT = 1000
"""Characters of an exception that are told."""

_SDK = str(Path(__file__).parent)


def raised(code: str, error: BaseException, by: Callable[..., Any]) -> Problem:
    """The problem of an exception that left a function of the plugin; a traceback is in its log."""
    return raised_in(code, error, str(getattr(by, "__module__", "")))


def raised_in(code: str, error: BaseException, module: str) -> Problem:
    """The same, of an exception that left code of that module."""
    text = f"{type(error).__name__}: {error}"[:MAX_TEXT]
    return Problem(code, text, where=_raised_at(error, module))


def module_of(work: Coroutine[Any, Any, Any]) -> str:
    """The module of a coroutine that has not begun; nothing where it is Python's own, which only
    waits for one of the plugin's."""
    frame: FrameType | None = getattr(work, "cr_frame", None)
    module = str(frame.f_globals.get("__name__", "")) if frame else ""
    return "" if module.partition(".")[0] in sys.stdlib_module_names else module


def _raised_at(error: BaseException, module: str) -> str:
    """File and line, within `site-packages`: the innermost one of the module's package, else of
    whatever is not the SDK; nothing where an exception has lost them on its way."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if _SDK not in f.filename]
    own = _home(module)
    mine = [frame for frame in frames if own and Path(frame.filename).is_relative_to(own)]
    if not frames:
        return ""
    last = (mine or frames)[-1]
    return f"{within_packages(last.filename)}:{last.lineno}"


def held_up(module: str) -> list[str]:
    """Where the other threads are in code of that module's package: `read, gps/plugin.py:33`."""
    own, frames = _home(module), sys._current_frames()
    threads = {*threading.enumerate()} - {threading.main_thread(), threading.current_thread()}
    stacks = [traceback.extract_stack(frames[t.ident]) for t in threads if t.ident in frames]
    found = [[f for f in stack if Path(f.filename).is_relative_to(own)] for stack in stacks if own]
    mine = [stack[-1] for stack in found if stack]
    return sorted(f"{f.name}, {within_packages(f.filename)}:{f.lineno}" for f in mine)


def within_packages(path: str) -> str:
    """A file as its author knows it: without the folder of packages that it was installed in.

    >>> within_packages("/v/lib/python3.11/site-packages/gps/plugin.py")
    'gps/plugin.py'
    """
    return path.rpartition("/site-packages/")[2]


def _home(module: str) -> str:
    """The folder of a module's package, or the file of a module that is in none."""
    whose = (sys.modules.get(name) for name in (module.partition(".")[0], module))
    file = next(filter(None, (getattr(one, "__file__", None) for one in whose)), "")
    return str(Path(file).parent) if file.endswith("__init__.py") else file
