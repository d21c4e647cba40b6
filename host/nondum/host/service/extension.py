"""The journal of systemd, as an extension."""

from __future__ import annotations

from collections.abc import Iterator

from nondum.host.core.events.event import Emit
from nondum.host.extension.hookspecs import Host, hookimpl
from nondum.host.service import journal
from nondum.host.service.journal_messages import JournalMessages


@hookimpl
def listeners(host: Host) -> Iterator[Emit]:
    """Events go to the journal where the daemon's log does."""
    if journal.is_in_use():
        yield JournalMessages(host.snapshot).on_event
