"""Pytest fixtures for authors of plugins; loaded by pytest itself, so it imports nothing early."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from nondum.sdk.bench import WorkerFactory


@pytest.fixture
def worker(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[WorkerFactory]:
    """Run plugins in this process, without a host, over the host's own protocol.

        def test_points_at_the_source(worker):
            head = worker("my_pointer", mounts={"head": ((0, 0, 1), (0, 0, 0))})
            head.set_value("bearing-known", "source", "robot", value=Bearing(…))
            call = head.behave("point", u="head", t="source", h="robot")
            call.wait_established()
            call.halt()

    See `nondum.sdk.bench.Bench` for what can be done with it. `worker.check()` checks the payload
    that the plugin is to be a part of.
    """
    from nondum.sdk.bench import WorkerFactory
    from nondum.sdk.source_check import source_folder

    with WorkerFactory(tmp_path, source_folder(request.path)) as factory:
        yield factory
