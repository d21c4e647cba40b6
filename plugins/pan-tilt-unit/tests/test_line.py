"""A device that is pulled while its port is opened has gone, as one that is pulled later."""

from __future__ import annotations

import fcntl
import termios
from types import ModuleType
from typing import Any

import pytest
from ptu_bench import Bench

from nondum.sdk.errors import BehaviourFailed
from nondum_pan_tilt_unit.line import Line

BAUD = 9600


@pytest.mark.parametrize(
    ("module", "call"),
    [(fcntl, "flock"), (termios, "tcgetattr"), (termios, "tcsetattr"), (termios, "tcflush")],
    ids=["locked", "asked", "set", "flushed"],
)
def test_a_device_pulled_before_its_port_is(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, module: ModuleType, call: str
) -> None:
    untouched = getattr(module, call)

    def pulled(*arguments: Any) -> Any:
        monkeypatch.undo()
        bench.unplug()
        return untouched(*arguments)

    monkeypatch.setattr(module, call, pulled)
    with pytest.raises(BehaviourFailed, match="SERIAL_FAILED"):
        Line(bench.node("head"), BAUD)
