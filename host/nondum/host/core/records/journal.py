"""Lines of the journal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from nondum.host.core.records.moment import Moment
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class JournalEntry:
    """One line of the journal."""

    id: int
    at: Moment
    boot: str
    """Which run of the daemon wrote it."""
    event: str
    """Name of the event."""
    subject: str
    """Payload id, component, device, drive or goal that it is about."""
    step: str = ""
    """The step that the payload came to, where there is one."""
    problems: tuple[Problem, ...] = ()
    detail: Mapping[str, Any] = field(default_factory=dict)
