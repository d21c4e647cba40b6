"""One key of a keyboard stops the robot; the daemon, who is not root, hears of no other key."""

from __future__ import annotations

from tests.kit.payloads import Part
from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.machine import Machine
from tests.lab.scenarios.feedback import DANCER

HOOK, TOLD = "/usr/local/bin/cut-power", "/run/nondum/cut"
STOP = """
[stop]
device = "{device}"
key = "KEY_F12"
hook = ["{hook}"]
"""


def run(lab: Lab) -> str:
    """Press keys while it dances; pull the keyboard, put it back, and press again."""
    host = lab.booted_once()
    machine = host.machine
    host.forget()
    keyboard = machine.plug_device("usb-kbd", port="1")
    device = machine.until(
        "its name", lambda: machine.attempt("ls /dev/input/by-id/*event-kbd").out.strip() or None
    )
    machine.put(HOOK, f"#!/bin/sh\ncat >>{TOLD}\n", 0o755)
    host.configure(STOP.format(device=device, hook=HOOK))
    host.start()
    stick = host.bring(lab.stick("dancer", Part("dancer", DANCER)), "org.example.dancer")
    _stopped(host, times=1)
    machine.unplug(keyboard)
    machine.until("a warning", lambda: _is_warned(machine) or None)
    keyboard = machine.plug_device("usb-kbd", port="1")
    machine.until("no warning", lambda: None if _is_warned(machine) else True)
    _stopped(host, times=2)
    machine.pull(stick)
    host.until_payload("org.example.dancer", "gone")
    host.stop()
    machine.unplug(keyboard)
    return device


def _stopped(host: Installed, *, times: int) -> None:
    """It dances until the key is pressed; `times` counts the runs of the hook so far."""
    machine = host.machine
    machine.run("nondum goal dance --wait")
    host.until_goal("dance", "holds")
    for other in ("f11", "spc", "pause"):
        machine.press(other)
    assert "dance" in machine.run("nondum plan"), "another key has stopped it"
    machine.press("f12")
    host.until_goal("dance", "halted")
    runs = f"grep -c goals {TOLD}"
    machine.until("the hook", lambda: machine.attempt(runs).out.strip() == str(times) or None)


def _is_warned(machine: Machine) -> bool:
    return "STOP_KEY" in machine.attempt("nondum status").out
