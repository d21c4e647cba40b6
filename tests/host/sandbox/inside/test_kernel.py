"""What cannot be given up is told; what is given up is gone for good."""

from __future__ import annotations

import os
import signal

import pytest
from tests.host.sandbox.inside.child import told

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="needs root: else there is nothing")
SETS = ("CapInh", "CapPrm", "CapEff", "CapBnd")
CAP_SYS_ADMIN = 1 << 21

FAILS = {
    "prctl(-1)": "EINVAL",
    "mount('/no-such', '/no-such', None, kernel.MS_BIND)": "ENOENT",
    "unmount('/no-such')": "ENOENT",
    "unshare(1)": "EINVAL",
    "filter_calls(b'')": "EINVAL",
    "restrict_to(-1)": "EBADF",
}
FAILS_ROOT = {
    "copy_mount('/no-such')": "ENOENT",
    "map_mount(-1, 2**31 - 1)": "EBADF",
    "place_mount(-1, '/tmp')": "EBADF",
}


@pytest.mark.parametrize("call", FAILS)
def test_what_the_kernel_does_not_do_is_told(call: str) -> None:
    nothing = "kernel.prctl(kernel.PR_SET_NO_NEW_PRIVS, 1)\n"  # or filters are for root only
    assert told(f"{nothing}tell(failure(lambda: kernel.{call}))") == FAILS[call]


@needs_root
@pytest.mark.parametrize("call", FAILS_ROOT)
def test_mount_that_the_kernel_does_not_make_is_told(call: str) -> None:
    assert told(f"tell(failure(lambda: kernel.{call}))") == FAILS_ROOT[call]


def test_capability_that_cannot_be_kept_is_told() -> None:
    assert (
        told(
            "kernel.keep_capabilities()\n"
            "tell(failure(lambda: kernel.keep_capabilities(kernel.CAP_SYS_ADMIN)))"
        )
        == "EPERM"
    )


@needs_root
@pytest.mark.parametrize("kept", [0, CAP_SYS_ADMIN])
def test_capabilities_are_gone_from_every_set(kept: int) -> None:
    words = "kernel.CAP_SYS_ADMIN" if kept else ""
    had = told("tell(status())")
    has = told(f"kernel.keep_capabilities({words})\ntell(status())")
    assert int(had["CapBnd"], 16) & ~CAP_SYS_ADMIN, "else there is nothing to see"
    assert {each: int(has[each], 16) for each in SETS} == dict.fromkeys(SETS, kept) | {"CapInh": 0}


def test_process_ends_with_the_one_that_started_it() -> None:
    number = told(
        "import ctypes\n"
        "kernel.end_with(os.getppid())\n"
        "number = ctypes.c_int()\n"
        "kernel.LIBC.prctl(2, ctypes.byref(number))  # PR_GET_PDEATHSIG\n"
        "tell(number.value)"
    )
    assert number == signal.SIGKILL


def test_process_ends_at_once_where_its_starter_has_ended() -> None:
    assert (
        told(
            "try:\n"
            "    kernel.end_with(os.getpid())  # which it is not\n"
            "except SystemExit:\n"
            "    tell('ends')"
        )
        == "ends"
    )
