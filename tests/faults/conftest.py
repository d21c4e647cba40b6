"""What the tests of faults share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.kit.fork_server import Nursery


@pytest.fixture(scope="session")
def nursery() -> Iterator[Nursery]:
    """Daemons that are to die, without the time that a start takes."""
    with Nursery() as nursery:
        yield nursery
