"""What becomes of drives and payloads that were left alone when safe mode ends."""

from __future__ import annotations

from nondum.host.core.effects import JudgePayloads
from nondum.host.core.events.daemon import SafeModeLeft
from nondum.host.core.events.payloads import RetryAsked
from nondum.host.core.records.safety import Safety
from nondum.host.lifecycle import drive_rules, releases
from nondum.host.lifecycle.safe_mode import CODE, waits
from nondum.host.lifecycle.turn import Turn


def on_left(turn: Turn, event: SafeModeLeft) -> None:
    """Take in what was left alone: drives, then payloads, of each the highest release first."""
    if turn.state.safety is Safety.OFF:
        return
    turn.events.append(event)
    turn.change(safety=Safety.OFF)
    for drive in list(turn.state.drives.values()):
        if any(found.code == CODE for found in drive.problems):
            drive_rules.read(turn, drive)
    waiting = [payload for payload in turn.state.payloads.values() if waits(payload)]
    waiting.sort(key=lambda payload: releases.precedence(turn.state, payload), reverse=True)
    turn.pending.extend(RetryAsked(payload.key) for payload in waiting)
    # The trust of this host may have changed meanwhile; nothing has checked what waits.
    turn.effects.append(JudgePayloads(tuple(payload.key for payload in waiting)))
