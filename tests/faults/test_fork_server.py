"""What is known of a daemon that ended otherwise than expected is in the assertion's message."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.fork_server import Nursery


def test_message_has_what_that_daemon_logged_and_no_other(nursery: Nursery, tmp_path: Path) -> None:
    (tmp_path / "log").write_text("of an earlier daemon\n")
    (tmp_path / "state").touch()
    with pytest.raises(AssertionError, match="ended with 1 instead of -9") as failed:
        nursery.run({"root": str(tmp_path)}, expect=-9)
    assert "STATE_UNWRITABLE" in str(failed.value)
    assert "of an earlier daemon" not in str(failed.value)
