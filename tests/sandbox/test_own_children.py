"""What the daemon's own children give up before they read what strangers wrote."""

from __future__ import annotations

import signal

import pytest
from tests.host.sandbox.inside.child import told

from nondum.host.sandbox.levels import refusals

SETTLED = """
import ctypes
from nondum.host.sandbox.levels import host_children
host_children.settle(os.getppid())
number = ctypes.c_int()
kernel.LIBC.prctl(2, ctypes.byref(number))  # PR_GET_PDEATHSIG
tell({**status(), "at the daemon's end": number.value})
"""


def test_child_ends_with_its_daemon() -> None:
    assert told(SETTLED)["at the daemon's end"] == signal.SIGKILL


def test_child_gains_no_privileges() -> None:
    assert told(SETTLED)["NoNewPrivs"] == "1"


@pytest.mark.skipif(not refusals.has_filters(), reason="knows no filters")
def test_child_has_its_calls_filtered() -> None:
    assert told(SETTLED)["Seccomp"] == "2"
