"""Each worker of a daemon that is not root but has the helper is a separate user."""

from __future__ import annotations

import os

import pytest
from tests.sandbox import service, service_checks

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="the helper is root's")


@pytest.fixture(scope="module")
def results() -> dict[str, str]:
    return service.results()


@pytest.mark.parametrize("check", [check.__name__ for check in service_checks.CHECKS])
def test_what_the_service_finds(results: dict[str, str], check: str) -> None:
    assert results[check] == ""
