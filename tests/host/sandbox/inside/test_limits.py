"""Limits of a worker's process are hard ones, and never more than the system has set already."""

from __future__ import annotations

import os
from typing import Any

import pytest
from tests.host.sandbox.inside.child import told

MEGABYTE = 1024 * 1024
GIVEN = {
    "memory_mb": 512,
    "descriptors": 100,
    "file_mb": 10,
    "core_mb": 0,
    "cpu_s": 1000,
    "tasks": None,
}
LIMITS = {
    "RLIMIT_DATA": 512 * MEGABYTE,
    "RLIMIT_NOFILE": 100,
    "RLIMIT_FSIZE": 10 * MEGABYTE,
    "RLIMIT_CORE": 0,
    "RLIMIT_CPU": 1000,
}


def limited(name: str, given: dict[str, Any], before: str = "") -> list[int]:
    """The soft and the hard limit afterwards."""
    program = f"{before}\nlimits.limit(given)\ntell(resource.getrlimit(resource.{name}))"
    found: list[int] = told(program, given)
    return found


@pytest.mark.parametrize("name", LIMITS)
def test_limit_is_hard(name: str) -> None:
    assert limited(name, GIVEN) == [LIMITS[name], LIMITS[name]]


def test_what_is_not_limited_stays_as_it_is() -> None:
    nothing = dict.fromkeys(GIVEN)
    assert limited("RLIMIT_NOFILE", nothing) == told(
        "tell(resource.getrlimit(resource.RLIMIT_NOFILE))"
    )


def test_tighter_limit_of_the_system_stays() -> None:
    before = "resource.setrlimit(resource.RLIMIT_NOFILE, (50, 50))"
    assert limited("RLIMIT_NOFILE", GIVEN, before) == [50, 50]


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to be another user")
def test_tasks_are_counted_from_those_that_its_user_has_already() -> None:
    before = "os.setresuid(61500, 61500, 61500)"  # a user that no other process has
    assert limited("RLIMIT_NPROC", {**GIVEN, "tasks": 20}, before) == [21, 21]
