"""Work that is counted, not timed: the same on each machine, however busy it is."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import TraceFunction


def steps_of(act: Callable[[], object]) -> int:
    """How many lines of Python an act runs, and how many functions it calls, C's too.

    Of caches, only what an act before has filled is full: act once before, where that matters.
    """
    steps = 0

    def on_line(frame: FrameType, event: str, argument: Any) -> TraceFunction:
        nonlocal steps
        steps += 1
        return on_line

    def on_call(frame: FrameType, event: str, argument: Any) -> None:
        nonlocal steps
        steps += event == "c_call"

    traced, profiled = sys.gettrace(), sys.getprofile()
    gc.collect()
    gc.disable()
    sys.setprofile(on_call)
    sys.settrace(on_line)
    try:
        act()
    finally:
        sys.settrace(traced)
        sys.setprofile(profiled)
        gc.enable()
    return steps
