"""Spoken states and an integrator's program, as an extension."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.extension.hookspecs import Host, Output, hookimpl
from nondum.host.people.conversation import LONGEST_SPOKEN
from nondum.host.people.feedback.hook import Hook
from nondum.host.people.feedback.speaking import Aloud


@hookimpl
def feedback_outputs(host: Host) -> Iterator[Output]:
    """The program, and what says states aloud, that `[feedback]` asks for."""
    section = host.config.feedback
    if section.hook:
        yield Hook(section.hook, section.hook_deadline_s)
    if section.speak:
        yield Aloud(host.say, host.told, LONGEST_SPOKEN)
