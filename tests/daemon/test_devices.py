"""Devices come and go while what needs them is at work, and two components want the same one."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import struct
from collections.abc import Callable, Iterator

import pytest
from demo import slots
from demo.emulators.port import Port
from tests.daemon.plugins import gauge
from tests.kit.running_host import Row, RunningHost

pytestmark = pytest.mark.daemon

TIOCSPTLCK, TIOCGPTN = 0x40045431, 0x80045430
"""Unlock the other end of a line, and tell its number (ioctl_tty(2))."""
WAITS = "waits for gauge"


Plug = Callable[..., Port]


@pytest.fixture
def plug_gauge(host: RunningHost) -> Iterator[Plug]:
    """Plugs a gauge in at a port; gives its end of the line."""
    with contextlib.ExitStack() as lines:

        def plug(port: str = "port-1") -> Port:
            line = Port()
            lines.callback(line.close)
            slots.plug(host.devices, port, line.path, {"ID_MODEL": "Gauge"})
            return line

        yield plug


def test_device_pulled_in_the_middle_of_a_behaviour(host: RunningHost, plug_gauge: Plug) -> None:
    line = plug_gauge()
    host.bring("gauge", gauge())
    before = host.until_component("gauge", "ready")
    goal = host.want("(measured spot)")
    host.until_goal(goal, "holds")
    line.hang_up()
    host.until_goal(goal, "active", "suspended")
    slots.unplug(host.devices, "port-1")
    host.until_component("gauge", WAITS)
    host.until_told("gauge waits for its device gauge")
    lacks = "ready spot__gauge__gauge"  # not that it failed again and again before the device went
    host.until("the goal lacks it", lambda _: lacks in host.until_goal(goal, "suspended")["reason"])
    (end, *_) = ends(host)
    assert end["outcome"] == "FAILED"
    assert end["reason"].startswith("GAUGE_GONE")
    plug_gauge("port-2")
    host.until_goal(goal, "holds")
    assert before["devices"] == {"gauge": "port-1"}
    # Its failures are told until its behaviour has held for a while.
    after = {**before, "devices": {"gauge": "port-2"}}
    host.until("it is as before", lambda _: host.component("gauge") == after)


def test_behaviour_that_does_not_notice_is_halted_when_its_device_goes(
    host: RunningHost, plug_gauge: Plug
) -> None:
    plug_gauge()
    host.bring("gauge", gauge())
    goal = host.want("(measured spot)")
    host.until_goal(goal, "holds")
    slots.unplug(host.devices, "port-1")  # the line is still there
    host.until_goal(goal, "suspended")
    (end,) = host.until("it has ended", lambda _: ends(host) or None)
    assert end["outcome"] == "HALTED"
    plug_gauge()
    host.until_goal(goal, "holds")


def ends(host: RunningHost) -> list[Row]:
    """How the gauge's behaviour has ended, each time that it has."""
    return [row["detail"] for row in host.journal("gauge") if row["event"] == "BehaviourEnded"]


def test_device_that_comes_after_its_component_is_as_good(
    host: RunningHost, plug_gauge: Plug
) -> None:
    host.bring("gauge", gauge())
    host.until_component("gauge", WAITS)
    goal = host.want("(measured spot)")
    host.until_goal(goal, "suspended")
    plug_gauge()
    host.until_goal(goal, "holds")


def test_one_device_for_two_stays_with_its_first_user_and_that_is_told(
    host: RunningHost, plug_gauge: Plug
) -> None:
    plug_gauge()
    host.bring("second", gauge("second"))
    host.until_component("second", "ready")
    host.bring("first", gauge("first"))
    host.until_component("first", WAITS)
    told = host.until_told("second has the device port-1, which first would need too")
    assert told.endswith("it stays with that component; a free device goes to the first by name")
    (row,) = host.ask("devices")
    assert (row["component"], row["contested_by"]) == ("second", ["first"])
    slots.unplug(host.devices, "port-1")
    host.until_component("second", WAITS)
    plug_gauge()
    host.until_component("first", "ready")
    assert host.until_component("second", WAITS)
    host.pull("first")
    host.until_component("second", "ready")


def test_device_that_is_not_needed_is_never_opened(host: RunningHost, plug_gauge: Plug) -> None:
    """The kernel tells the other end of a line once anybody has opened and closed it."""
    line, slave = unopened_line()
    try:
        slots.plug(host.devices, "port-9", slave, {"ID_MODEL": "Other", "SUBSYSTEM": "tty"})
        plug_gauge()
        host.bring("gauge", gauge())
        goal = host.want("(measured spot)")
        host.until_goal(goal, "holds")
        assert {row["device"]: row["component"] for row in host.ask("devices")} == {
            "port-1": "gauge",
            "port-9": "",
        }
        host.ask("devices_why")
        slots.unplug(host.devices, "port-9")
        slots.unplug(host.devices, "port-1")
        host.until_goal(goal, "suspended")
        assert not was_opened(line)
        os.close(os.open(slave, os.O_RDWR | os.O_NOCTTY))
        assert was_opened(line)
    finally:
        os.close(line)


def unopened_line() -> tuple[int, str]:
    """One end of a terminal's line, and the path of the other, which was never open."""
    line = os.open("/dev/ptmx", os.O_RDWR | os.O_NOCTTY | os.O_CLOEXEC)
    fcntl.ioctl(line, TIOCSPTLCK, struct.pack("i", 0))
    (number,) = struct.unpack("I", fcntl.ioctl(line, TIOCGPTN, struct.pack("I", 0)))
    return line, f"/dev/pts/{number}"


def was_opened(line: int) -> bool:
    """Whether anybody has opened the other end, and closed it again."""
    poll = select.poll()
    poll.register(line, 0)
    return any(events & select.POLLHUP for _, events in poll.poll(0))


def test_software_that_was_here_is_named_for_a_device_that_has_none(
    host: RunningHost, plug_gauge: Plug
) -> None:
    host.bring("gauge", gauge())
    host.until_component("gauge", WAITS)
    host.pull("gauge")
    host.until_gone("gauge")
    plug_gauge()
    told = host.until_told("nothing here drives Gauge (port-1)")
    assert "org.example.gauge 1.0 (here until" in told
