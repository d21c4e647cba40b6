"""A device that is pulled while its port is opened has gone, as one that is pulled later."""

from __future__ import annotations

import fcntl
import termios
from types import ModuleType
from typing import Any

import pytest
from line_bench import Camera

from nondum.sdk.errors import BehaviourFailed
from nondum_compton_camera.line import Line

BAUD = 9600


@pytest.mark.parametrize(
    ("module", "call"),
    [(fcntl, "flock"), (termios, "tcgetattr"), (termios, "tcsetattr"), (termios, "tcflush")],
    ids=["locked", "asked", "set", "flushed"],
)
def test_a_device_pulled_before_its_port_is(
    camera: Camera, monkeypatch: pytest.MonkeyPatch, module: ModuleType, call: str
) -> None:
    untouched = getattr(module, call)

    def pulled(*arguments: Any) -> Any:
        monkeypatch.undo()
        camera.unplug()
        return untouched(*arguments)

    monkeypatch.setattr(module, call, pulled)
    with pytest.raises(BehaviourFailed, match="SERIAL_FAILED"):
        Line(camera.node, BAUD)
