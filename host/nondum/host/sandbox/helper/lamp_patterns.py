"""How a lamp shows each state: by rhythm alone, since not everybody sees every colour."""

from __future__ import annotations

from collections.abc import Mapping

from nondum.host.core.feedback_state import State
from nondum.sdk.frozen import frozen


@frozen
class Pattern:
    """What the kernel is told to do with a lamp (Documentation/leds/leds-class.rst)."""

    trigger: str
    """`none`: lit for good. `timer`: on and off in turn. `heartbeat`: two beats and a rest."""
    on_ms: int = 0
    off_ms: int = 0


PATTERNS: Mapping[State, Pattern] = {
    State.READY: Pattern("none"),
    State.WORKING: Pattern("timer", 100, 100),
    State.SAFE: Pattern("timer", 200, 1800),
    State.REFUSED: Pattern("timer", 1400, 200),
    State.HELP: Pattern("heartbeat"),
}
"""Lit; a quick flutter; a short flash now and then; lit but for a wink; a beating heart."""
