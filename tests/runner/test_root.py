"""CI is root: what needs it is not passed over there."""

from __future__ import annotations

import os

import pytest
from tests.runner import hardware
from tests.runner.result import Result
from tests.runner.verdict import Findings

NEED_ROOT = (
    "tests/host/sandbox/helper/test_disks.py",
    "tests/host/sandbox/helper/test_device_nodes.py",
    "tests/host/sandbox/helper/test_server.py",
    "tests/host/sandbox/helper/test_service.py",
    "tests/host/sandbox/cgroups/test_groups.py",
    "tests/host/sandbox/helper/test_block_devices.py",
    "tests/faults/test_power.py",
    "tests/faults/test_disk.py",
    "tests/transport/peers/test_keys.py",
)
"""Files of tests that root is enough for: no hardware excuses that they are skipped."""


def test_ci_is_root() -> None:
    """So that what needs root and hardware is not passed over for want of root, either."""
    assert os.geteuid() == 0 or not os.environ.get("CI")


@pytest.mark.parametrize("file", NEED_ROOT)
def test_skip_for_want_of_root_fails_a_run_in_ci(file: str) -> None:
    skipped = Result(f"{file}::test_it", "skipped", 0.0, reason="needs root")
    refused = hardware.refused([skipped], hardware.read(), {"CI": "true"})
    assert refused == (skipped,)
    assert not Findings((skipped,), refused_skips=refused).is_green


def test_skip_fails_no_run_elsewhere() -> None:
    skipped = Result(f"{NEED_ROOT[0]}::test_it", "skipped", 0.0, reason="needs root")
    assert hardware.refused([skipped], hardware.read(), {}) == ()
