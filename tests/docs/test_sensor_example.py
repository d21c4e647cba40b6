"""The worked sensor of docs/sdk.md works: it is taken from the page, and run on the bench."""

from __future__ import annotations

import os
import re
import tty
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import pytest
from tests.docs.reference import DOCS

from nondum.planning.merge.contribution import Contribution
from nondum.planning.merge.merge import merge
from nondum.sdk import GpsFix
from nondum.sdk.bench import WorkerFactory
from nondum.sdk.plugin import describe, load

PAGE = DOCS / "sdk.md"
FIX = "$GPGGA,123519,4807.038,N,01131.000,W,1,08,0.9,545.4,M,46.9,M,,*47"
NO_FIX = "$GPGGA,123519,,,,,0,00,,,M,,M,,*66"


def example() -> ModuleType:
    """The plugin in the section `A sensor with a condition`."""
    section = PAGE.read_text(encoding="utf-8").partition("## A sensor with a condition\n")[2]
    found = re.search(r"^```python\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
    assert found is not None
    module = ModuleType("gps_example")
    exec(compile(found[1], str(PAGE), "exec"), vars(module))  # the page's own code
    return module


@pytest.fixture
def line() -> Iterator[tuple[int, str]]:
    """A serial line: where the receiver writes, and its node."""
    master, slave = os.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    os.close(master)
    os.close(slave)


def test_sensor_of_the_page_tells_where_it_is(worker: WorkerFactory, line: tuple[int, str]) -> None:
    receiver, node = line
    bench = worker(example(), devices={"receiver": node})
    os.write(receiver, f"{NO_FIX}\r\n$GPGSV,3,1\r\n{FIX}\r\n".encode())
    fix: Any = bench.wait_fact("position-known", "robot")
    assert isinstance(fix, GpsFix)
    assert fix.latitude_deg == pytest.approx(48.1173)
    assert fix.longitude_deg == pytest.approx(-11.516667)
    assert fix.altitude_m == pytest.approx(592.3)
    assert bench.read("fix") == fix
    bench.stop()
    assert bench.facts == {}


def test_fragment_of_the_page_is_taken() -> None:
    description = describe(load(example(), "gps-example"))
    contribution = Contribution.from_description(description, host="robot", component="gps")
    merged = merge((contribution,), "robot")
    assert not merged.quarantined
    assert merged.domain.predicates["position-known"].value_type == "gps-fix"
