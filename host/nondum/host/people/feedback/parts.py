"""Feedback as the configuration asks for it: what is listened to, what shows it, and how long."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.feedback_section import FeedbackSection
from nondum.host.core.feedback_state import StateReason
from nondum.host.mind.mind import Mind
from nondum.host.people.conversation import LONGEST_SPOKEN, UNSAID, Conversation
from nondum.host.people.feedback.feedback import Feedback, Sources
from nondum.host.people.feedback.hook import Hook
from nondum.host.people.feedback.lamp_output import LampOutput
from nondum.host.people.feedback.outputs import Output
from nondum.host.people.feedback.player import Player
from nondum.host.people.feedback.showing import Durations
from nondum.host.people.feedback.speaking import Aloud


def made(
    section: FeedbackSection,
    state: Path,
    catalogue: Catalogue,
    mind: Mind,
    places: Callable[[], Mapping[str, str]],
    more: Callable[[], tuple[StateReason, ...]],
    conversation: Conversation,
    on_change: Callable[[], None],
) -> Feedback:
    """Make the feedback for people without a screen. `state` is the daemon's folder, `places` the
    payloads that run on peers, `more` the state reasons that other parts of the host work out;
    `on_change` is called whenever another state is shown."""
    sources = Sources(catalogue.snapshot, places, lambda: mind.queue, more)
    durations = Durations(section.refused_s, section.safe_s)
    outputs = tuple(_outputs(section, state, mind, conversation))
    return Feedback(sources, durations, outputs, on_change=on_change)


def _outputs(
    section: FeedbackSection, state: Path, mind: Mind, conversation: Conversation
) -> Iterator[Output]:
    """All that is configured."""

    def told() -> list[str]:
        return [said.text for said in mind.people.since(mind.people.last_number - UNSAID)]

    if section.lamps:
        yield LampOutput(section.lamps, state / "lamps.json")
    if section.player:
        yield Player(section.player)
    if section.hook:
        yield Hook(section.hook, section.hook_deadline_s)
    if section.speak:
        yield Aloud(conversation.say, told, LONGEST_SPOKEN)
