"""What every test of this plugin may ask for."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from ptu_bench import Bench


@pytest.fixture
def anyio_backend() -> str:
    return "asyncio"


@pytest.fixture
def bench() -> Iterator[Bench]:
    on_table = Bench()
    yield on_table
    on_table.close()
