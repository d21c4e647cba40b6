"""System calls that fail, or never return: told as what they are, survived, and nothing is left.

The long form, `python -m tests.faults`, goes through some thousands of them.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.faults.points import Point
from tests.kit.fork_server import Nursery

pytestmark = pytest.mark.slow

FAILS = ("ENOSPC openat 300", "EIO fdatasync 6", "ENOMEM clone3 1")
KILLS = ("fdatasync 9", "link 20")


def point(kind: str, name: str) -> Point:
    *error, call, nth = name.split()
    return Point(kind, name, {"call": call, "nth": int(nth), "error": "".join(error)})


@pytest.mark.parametrize("name", FAILS)
def test_call_fails(nursery: Nursery, tmp_path: Path, name: str) -> None:
    result = point("error", name).run(nursery, tmp_path)
    assert not result.wrong
    assert result.outcome == "lived"


@pytest.mark.parametrize("name", KILLS)
def test_kill_at_a_call(nursery: Nursery, tmp_path: Path, name: str) -> None:
    assert not point("kill", name).run(nursery, tmp_path).wrong
