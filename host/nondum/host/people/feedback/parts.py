"""Feedback as the configuration asks for it: what is listened to, and how long it is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.feedback_section import FeedbackSection
from nondum.host.core.feedback_state import StateReason
from nondum.host.extension.hookspecs import Output
from nondum.host.mind.mind import Mind
from nondum.host.people.feedback.feedback import Feedback, Sources
from nondum.host.people.feedback.showing import Durations


def made(
    section: FeedbackSection,
    catalogue: Catalogue,
    mind: Mind,
    places: Callable[[], Mapping[str, str]],
    more: Callable[[], tuple[StateReason, ...]],
    outputs: Iterable[Output],
    on_change: Callable[[], None],
) -> Feedback:
    """Make the feedback for people without a screen. `places` are the payloads that run on peers,
    `more` the state reasons that other parts of the host work out, `outputs` those of extensions;
    `on_change` is called whenever another state is shown."""
    sources = Sources(catalogue.snapshot, places, lambda: mind.queue, more)
    durations = Durations(section.refused_s, section.safe_s)
    return Feedback(sources, durations, tuple(outputs), on_change=on_change)
