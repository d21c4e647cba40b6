"""Hosts for tests of whole daemons."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.kit.running_host import RunningHost, running
from tests.kit.shared import Shared


@pytest.fixture(scope="module")
def one_host(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shared[list[RunningHost]]]:
    """The host that the tests of a module share."""

    @contextmanager
    def start() -> Iterator[list[RunningHost]]:
        with running(tmp_path_factory.mktemp("host")) as host:
            yield [host]

    with Shared(start) as shared:
        yield shared


@pytest.fixture
def host(one_host: Shared[list[RunningHost]]) -> Iterator[RunningHost]:
    """A host with nothing plugged in, on which nothing of this test may be left."""
    with one_host.lent() as (host,):
        yield host


@pytest.fixture
def own_host(tmp_path: Path) -> Iterator[RunningHost]:
    """A host with nothing plugged in, to be killed or stopped."""
    with running(tmp_path) as host:
        yield host
