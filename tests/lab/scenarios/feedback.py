"""A lamp, a hook and the status tell each stick's way; a goal on a stick moves the robot."""

from __future__ import annotations

from pathlib import Path

from tests.kit.payloads import Part
from tests.lab.drives import fat_stick
from tests.lab.installed import REPLUGS, Installed
from tests.lab.lab import Lab
from tests.lab.machine import Machine

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.helper.lamp_patterns import PATTERNS, Pattern
from nondum.wheelhouse.build import goal_payload

PATIENT = "/run/systemd/system/nondum.service.d/patient.conf"
"""A new keyboard, a new service, and emulated processors: nothing here is judged by its time."""
HOOK = "/usr/local/bin/tell"
TOLD = "/run/nondum/told"
BLINKING = "cp /opt/nondum/packaging/modules-load.d/nondum.conf /etc/modules-load.d/nondum.conf"
LOADED = "systemctl restart systemd-modules-load.service"
FEEDBACK = """
[feedback]
lamps = ["{lamp}"]
hook = ["{hook}"]
refused_s = 100000
safe_s = 40
"""
DANCER = '''"""Dances."""
from nondum.sdk import Fragment, Unit, behaviour, hookimpl

DOMAIN = """
(define (domain dancer)
  (:predicates (dancing ?h - host))
  (:action dance
    :parameters (?u - base ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u))
    :effect (and (not (idle ?u)) (dancing ?h))))
"""

@hookimpl
def units():
    return [Unit("legs", "base")]

@hookimpl
def fragments():
    return [Fragment("dancer.pddl", DOMAIN)]

@behaviour("dance", action="(dance ?u - base ?h - host)", lasting=True, phrase="dance")
async def dance(ctx, u, h):
    await ctx.established()
    while True:
        await ctx.sleep(60)
'''


def run(lab: Lab) -> str:
    """A keyboard's lamp through all states, then a goal that waits for who can have it."""
    host = lab.booted_once()
    machine = host.machine
    host.forget()
    machine.run(f"{BLINKING} && {LOADED}")
    keyboard = machine.plug_device("usb-kbd")
    lamp = machine.until("a lamp", lambda: _lamp(machine))
    before = _trigger(machine, lamp)
    machine.put(HOOK, f'#!/bin/sh\necho "$1 $2" >>{TOLD}\n', 0o755)
    host.configure(FEEDBACK.format(lamp=lamp, hook=HOOK))
    machine.put(PATIENT, "[Service]\nTimeoutStartSec=1000\nWatchdogSec=0\n")
    machine.run("systemctl daemon-reload")
    host.start()
    _until_shown(machine, lamp, State.READY)
    dancer = lab.stick("dancer", Part("dancer", DANCER))
    stick = _bring(machine, dancer, lamp)
    assert _payloads(host) == {"org.example.dancer": "active"}
    machine.pull(stick)
    _until_shown(machine, lamp, State.READY)
    empty = machine.plug(fat_stick(lab.folder() / "empty.img", None))
    _until_shown(machine, lamp, State.REFUSED)
    machine.pull(empty)
    _until_shown(machine, lamp, State.READY)
    _dance_for_a_goal(lab, host, lamp)
    told = machine.run(f"cat {TOLD}").split("\n")
    for line in ("working", "safe-to-remove", "refused DRIVE_NOT_PAYLOAD", "ready"):
        assert line in map(str.strip, told), told
    host.stop()
    machine.until("as before", lambda: _trigger(machine, lamp) == before or None)
    machine.unplug(keyboard)
    machine.run(f"rm {PATIENT} && systemctl daemon-reload")
    return f"{lamp}, told {len(told) - 1} times"


def _bring(machine: Machine, image: Path, lamp: str) -> str:
    """Plug a stick in until the lamp says that it may be pulled; one that stalls is plugged in
    again, as `Installed.bring` does."""
    for attempt in range(REPLUGS):
        machine.replugs += attempt > 0
        stick = machine.plug(image)
        _until_shown(machine, lamp, State.WORKING)
        if _until_shown(machine, lamp, State.SAFE, State.REFUSED) is State.SAFE:
            return stick
        told = machine.run(f"tail -n 3 {TOLD}")
        assert "DRIVE_STALLED" in told, told
        machine.pull(stick)
        _until_shown(machine, lamp, State.READY)
    raise AssertionError(f"the drive stalled {REPLUGS} times")


def _dance_for_a_goal(lab: Lab, host: Installed, lamp: str) -> None:
    """The goal comes first, and waits for the payload that knows its words."""
    files = lab.folder()
    goal_payload.write(files / "files", "org.example.delivery", ["dance"])
    delivery = host.bring(
        fat_stick(files / "delivery.img", files / "files"), "org.example.delivery"
    )
    _until_shown(host.machine, lamp, State.HELP)
    dancer = host.bring(
        lab.stick("dancer", Part("dancer", DANCER), release=2), "org.example.dancer"
    )
    host.until_goal("dance", "holds")
    host.machine.pull(delivery)
    host.until_goal("dance", "halted")
    host.machine.pull(dancer)
    host.until_payload("org.example.dancer", "gone")


def _lamp(machine: Machine) -> str | None:
    """The name of a lamp of the keyboard that hangs on USB."""
    command = "for lamp in /sys/class/leds/*::scrolllock; do readlink -f $lamp; done"
    found = [path for path in machine.attempt(command).out.split() if "/usb" in path]
    return found[0].rpartition("/")[2] if found else None


def _trigger(machine: Machine, lamp: str) -> str:
    said = machine.run(f"cat /sys/class/leds/{lamp}/trigger")
    return said.partition("[")[2].partition("]")[0]


def _until_shown(machine: Machine, lamp: str, *states: State) -> State:
    """Wait until the kernel has the lamp show one of some states."""

    def shown() -> State | None:
        files = machine.attempt(f"cd /sys/class/leds/{lamp} && tail -n 1 * 2>/dev/null").out
        said = dict(_file(part) for part in files.split("==> ")[1:])
        return next((state for state in states if _is_shown(PATTERNS[state], said)), None)

    return machine.until(f"{lamp} shows {' or '.join(s.value for s in states)}", shown)


def _is_shown(pattern: Pattern, said: dict[str, str]) -> bool:
    if f"[{pattern.trigger}]" not in said.get("trigger", ""):
        return False
    if pattern.trigger == "timer":
        delays = (said.get("delay_on"), said.get("delay_off"))
        return delays == (str(pattern.on_ms), str(pattern.off_ms))
    return pattern.trigger != "none" or said["brightness"] == said["max_brightness"]


def _file(part: str) -> tuple[str, str]:
    name, _, text = part.partition(" <==")
    return name, text.strip()


def _payloads(host: Installed) -> dict[str, str]:
    view = host.status()
    return {row["payload"]: row["state"] for row in view["payloads"]} if view else {}
