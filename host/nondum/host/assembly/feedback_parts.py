"""Makes what extensions show to people without a screen, and what they follow."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nondum.host.assembly.base import Base
from nondum.host.core.feedback_state import StateReason
from nondum.host.extension.hookspecs import Host, Say
from nondum.host.mind.mind import Mind
from nondum.host.people.feedback import parts
from nondum.host.people.feedback.feedback import Feedback


def make_feedback(
    base: Base,
    mind: Mind,
    *,
    say: Say,
    places: Callable[[], Mapping[str, str]],
    more: Callable[[], tuple[StateReason, ...]],
    on_change: Callable[[], None],
) -> Feedback:
    """Subscribe the listeners of extensions, make what their outputs show, and subscribe that; note
    which keys lack an extension. `more` are state reasons of goals that wait."""
    config, catalogue, extensions = base.config, base.catalogue, base.extensions
    extensions.note_missing(config)
    host = Host(config, base.folders.root, catalogue.snapshot, say, mind.people.newest)
    for listener in extensions.asked("listeners", host=host):
        base.bus.subscribe(listener)
    outputs = extensions.asked("feedback_outputs", host=host)
    feedback = parts.made(config.feedback, catalogue, mind, places, more, outputs, on_change)
    base.bus.subscribe(feedback.on_event)
    return feedback
