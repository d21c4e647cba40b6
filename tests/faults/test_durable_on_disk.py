"""What was promised is on disk, even where a real file system would hide a missing sync.

Every promise of tests/faults/promising.py is looked at after every system call, with everything
lost that was not synced by then; and every sync is left out once.
"""

from __future__ import annotations

import pytest
from tests.faults.traced_disk import SYNCS, Call, Event, broken, recorded

OUR_SYNCS = frozenset(SYNCS) - {"fdatasync"}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def events(tmp_path_factory: pytest.TempPathFactory) -> list[Event]:
    root = tmp_path_factory.mktemp("promises")
    folder, elsewhere = root / "disk", root / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    command = ["-m", "tests.faults.promising", str(folder), str(elsewhere)]
    return recorded(folder, command, root / "calls", TMPDIR=str(elsewhere))


def test_what_was_promised_survives_without_unsynced_writes(events: list[Event]) -> None:
    assert broken(events) == []


def test_each_sync_left_out_breaks_a_promise(events: list[Event]) -> None:
    """But for some of SQLite's, which syncs by fdatasync and more often than is asked for here."""
    needless = [
        f"{event.name} {event.paths[0]}"
        for number, event in enumerate(events)
        if isinstance(event, Call) and event.name in OUR_SYNCS and not broken(events, number)
    ]
    assert needless == []
