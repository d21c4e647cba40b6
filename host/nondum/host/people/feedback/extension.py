"""Lamps, sounds, spoken states and an integrator's program, as an extension."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.extension.hookspecs import Host, Output, hookimpl
from nondum.host.people.conversation import LONGEST_SPOKEN
from nondum.host.people.feedback.hook import Hook
from nondum.host.people.feedback.lamp_output import LampOutput
from nondum.host.people.feedback.player import Player
from nondum.host.people.feedback.speaking import Aloud


@hookimpl
def feedback_outputs(host: Host) -> Iterator[Output]:
    """All that `[feedback]` asks for."""
    section = host.config.feedback
    if section.lamps:
        yield LampOutput(section.lamps, host.folder / "lamps.json")
    if section.player:
        yield Player(section.player)
    if section.hook:
        yield Hook(section.hook, section.hook_deadline_s)
    if section.speak:
        yield Aloud(host.say, host.told, LONGEST_SPOKEN)
