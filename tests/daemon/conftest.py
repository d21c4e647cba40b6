"""The lab's world: a host that runs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.running_host import RunningHost, running


@pytest.fixture
def host(tmp_path: Path) -> Iterator[RunningHost]:
    """A host with nothing plugged in."""
    with running(tmp_path) as host:
        yield host
