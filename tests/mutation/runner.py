"""Runs tests over and over: each time in a child of this process, which has loaded pytest already.

Of the project itself nothing is loaded before the child begins, so each child sees the source as it
is by then. Reads a list of pytest's arguments as a line of JSON, and answers with a line: the first
test that failed, or null.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import json
import os
import signal
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from hypothesis import is_hypothesis_test, settings
from tests.kit.descendants import descendants

WARM = ("anyio", "cryptography.hazmat.primitives.asymmetric.ed25519", "packaging.pylock", "msgpack")
"""What most tests load, too."""
LIMIT_S = 150
"""A test that is still at it then has failed: nothing else could end it."""
STARTED = Path(".mutation-started")
"""Where the test is noted that runs, in the copy."""
UNTOLD = "the tests do not begin"
"""In the place of a test."""
IMPORTED = "ignore::pytest.PytestAssertRewriteWarning"
"""What is loaded before pytest begins keeps its assertions as they are."""
OPTIONS = (
    *("-x", "-q", "-p", "no:cacheprovider", "-W", IMPORTED),
    *("--hypothesis-profile=mutation", "--timeout=60"),
)
SEEDS = (1, 2, 3)
PR_SET_CHILD_SUBREAPER = 36
"""prctl(2)."""


class _Listener:
    """Notes what fails; takes either the tests of properties, or the others."""

    def __init__(self, *, properties: bool) -> None:
        self._properties = properties
        self.started: str | None = None
        self.failed: str | None = None

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items[:] = [item for item in items if _is_property(item) == self._properties]

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.started = nodeid
        STARTED.write_text(nodeid)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and self.failed is None:
            self.failed = report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed and self.failed is None:
            self.failed = report.nodeid


def first_failure(tests: list[str]) -> str | None:
    """The first test that fails. One of a property counts only if it does with every seed."""
    failed, is_any = _run(tests, properties=False)
    if failed is not None:
        return failed
    for seed in SEEDS:
        failed, are_any = _run([*tests, f"--hypothesis-seed={seed}"], properties=True)
        if failed is None:
            return None if is_any or are_any else UNTOLD
        tests = [failed]
    return failed


def _run(arguments: list[str], *, properties: bool) -> tuple[str | None, bool]:
    """What has failed, and whether there was anything to run."""
    listener = _Listener(properties=properties)
    try:
        status = pytest.main([*OPTIONS, *arguments], plugins=[listener])
    except Exception:  # what a test has left open is told when all is over
        status = pytest.ExitCode.INTERNAL_ERROR
    if status in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        return None, status == pytest.ExitCode.OK
    return listener.failed or listener.started or UNTOLD, True


def _is_property(item: Any) -> bool:
    return is_hypothesis_test(getattr(item, "obj", None))


def main() -> None:
    """Answer until there are no more questions."""
    if ctypes.CDLL(None, use_errno=True).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "PR_SET_CHILD_SUBREAPER")
    settings.register_profile("mutation", derandomize=False, database=None, deadline=None)
    for name in WARM:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for line in sys.stdin:
        answers.write(json.dumps(_in_child(json.loads(line))) + "\n")
        answers.flush()


def _in_child(tests: list[str]) -> str | None:
    receiver, sender = os.pipe()
    child = os.fork()
    if child == 0:
        os.setsid()
        failed: str | None = UNTOLD
        try:
            failed = first_failure(tests)
        finally:
            os.write(sender, json.dumps(failed).encode())
            os._exit(0)
    os.close(sender)
    late = threading.Timer(LIMIT_S, os.kill, (child, signal.SIGKILL))
    late.start()
    os.waitpid(child, 0)
    late.cancel()
    late.join()
    end_what_is_left()
    heard = os.read(receiver, 65536)
    os.close(receiver)
    answer: str | None = json.loads(heard) if heard else STARTED.read_text()
    return answer


def end_what_is_left() -> None:
    """End all that the tests have started: what was removed may be what would have ended it."""
    own = os.getpid()
    children = Path(f"/proc/{own}/task/{own}/children")
    while children.read_text(encoding="ascii"):  # orphans become this process's own
        for sent in (signal.SIGSTOP, signal.SIGKILL):  # or one would fork while another is killed
            for pid in descendants(own):
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, sent)
        with contextlib.suppress(ChildProcessError):
            os.waitpid(-1, 0)


if __name__ == "__main__":
    main()
