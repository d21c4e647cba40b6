"""Strangers with phrases and labels, and what can be said to a robot that has them."""

from __future__ import annotations

from dataclasses import replace

from tests.planning.strangers import (
    COMPTON_CAMERA,
    MOBILE_BASE,
    PAN_TILT_UNIT,
    PEOPLE_DETECTOR,
    ROVER,
    components,
)

from nondum.planning.merge.goal import Goal, goal_text
from nondum.planning.merge.merge import merge
from nondum.planning.words.phrases import Phrasebook, phrasebook
from nondum.sdk.description import Label, Phrase, PluginDescription


def saying(plugin: PluginDescription, *phrases: str) -> PluginDescription:
    """The plugin with phrases on its first behaviour."""
    first, *others = plugin.behaviours
    return replace(plugin, behaviours=(replace(first, phrases=phrases), *others))


POINTER = saying(PAN_TILT_UNIT, "point at {t}")
COMPTON = replace(COMPTON_CAMERA, labels=(Label("radiation-source", "the radiation source"),))
BASE = replace(
    MOBILE_BASE,
    phrases=(Phrase("follow {c:class} [through {words:text}]", "(following self ?c)", "maintain"),),
)
DETECTOR = replace(PEOPLE_DETECTOR, labels=(Label("person", "me"), Label("person", "people")))


def book(*plugins: PluginDescription) -> Phrasebook:
    contributions = components(plugins)
    return phrasebook(contributions, merge(contributions, ROVER))


def asked(goal: Goal) -> tuple[str, str]:
    return goal.kind, goal_text(goal.expr)
