"""The hooks of the host that this extension implements; its entry point names this module."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.extension.hookspecs import Host, Output, hookimpl
from nondum_host_lamps.lamp_output import LampOutput
from nondum_host_lamps.player import Player

NAME = "host-lamps"
"""Of the entry point."""


@hookimpl
def config_keys() -> tuple[str, ...]:
    """The keys that `feedback_outputs` reads."""
    return "feedback.lamps", "feedback.player"


@hookimpl
def feedback_outputs(host: Host) -> Iterator[Output]:
    """The lamps and the player that the configuration asks for."""
    section = host.config.feedback
    if section.lamps:
        yield LampOutput(section.lamps, host.folder / "extensions" / NAME / "lamps.json")
    if section.player:
        yield Player(section.player)
