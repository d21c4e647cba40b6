"""The GPS payload on a real host: confined, over a serial line, it knows where the robot is."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from demo import slots
from demo.drives import build
from tests.kit.running_host import RunningHost
from tests.kit.until import until

pytestmark = pytest.mark.daemon

PLUGINS = Path(__file__).parents[2] / "plugins"
U_BLOX = {"SUBSYSTEM": "tty", "ID_BUS": "usb", "ID_VENDOR_ID": "1546", "ID_MODEL_ID": "01a8"}
NAMED = {"SUBSYSTEM": "tty", "ID_BUS": "usb", "ID_VENDOR_ID": "067b", "NONDUM_GPS": "1"}
ANSWER = "51.05000 N, 13.74000 E, 118 m, 8 satellites"
OTHER = {"SUBSYSTEM": "tty", "ID_BUS": "usb", "ID_VENDOR_ID": "067b"}


@pytest.fixture
def line(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """What the plugin's own tests simulate a receiver with."""
    monkeypatch.syspath_prepend(PLUGINS / "gps/tests")
    return importlib.import_module("simulated_receiver")


@pytest.fixture
def receiver(line: ModuleType) -> Iterator[Any]:
    """A simulated one."""
    simulated = line.SimulatedReceiver()
    yield simulated
    simulated.unplug()


def test_robot_knows_and_tells_where_it_is_while_there_is_a_fix(
    own_host: RunningHost, line: ModuleType, receiver: Any, tmp_path: Path
) -> None:
    host = own_host
    host.plug(build([PLUGINS / "gps"], libraries=[PLUGINS / "sdk"], cache=tmp_path / "gps")["gps"])
    host.until_component("gps", "ready")
    slots.plug(host.devices, "other", receiver.node, OTHER)
    slots.plug(host.devices, "mouse", receiver.node, U_BLOX)
    receiver.says(line.NO_FIX)
    goal = host.want("(position-told spot)", kind="do")
    needs = host.until_goal(goal, "suspended")["needs"]
    assert [need["code"] for need in needs] == ["WHY_NOT_TOLD"]
    receiver.says(line.gsa(3), line.gga())
    assert host.until_goal(goal, "reached")["reason"] == ANSWER
    again = host.want("(position-told spot)", kind="do")
    assert host.until_goal(again, "reached")["reason"] == ANSWER
    assert host.until_component("gps", "ready")["devices"] == {"receiver": "mouse", "adapter": None}
    slots.unplug(host.devices, "mouse")
    until("the position is forgotten", lambda: not knows(host))
    slots.plug(host.devices, "adapter", receiver.node, NAMED)
    until("the position is known", lambda: knows(host))
    assert host.until_component("gps", "ready")["devices"] == {
        "receiver": None,
        "adapter": "adapter",
    }


def knows(host: RunningHost) -> bool:
    return any(row["fact"] == "position-known spot" for row in host.ask("facts"))
