"""What a host takes at rest is held: memory by the promise, modules by name and by number.

Bytes are no times: these do not depend on who else works on the machine. On the targets themselves
`./run lab footprint` measures, and holds the same.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from benchmarks.footprint import probe, report, results
from benchmarks.footprint.host import await_worker, running
from tests.daemon.plugins import talker
from tests.kit.payloads import make_payload

MB = 1_000_000
DAEMON_MB, WORKER_MB = 60, 20
MODULES = 410
"""Of others, a few more than there are. Who goes beyond asks first which of them could wait until
needed. nondum's own are small, and what they take is bounded as memory."""
OTHERS = {
    *("_cffi_backend", "ifaddr", "importlib_metadata", "isal", "lark", "lazy_importer", "msgpack"),
    *("packaging", "pluggy", "py_trees", "pydot", "pyparsing", "pyudev", "zipp", "zmq"),
}
"""Distributions of others that a daemon with peers may import before it is asked anything."""
OF_TOOLS = {"_distutils_hack", "coverage"}
"""What an environment for development has every interpreter import."""
HEAVY = {"PIL", "cryptography", "http.client", "multiprocessing.pool", "pip", "unittest", "xml"}
IMPORTED = """
import json, sys
import nondum.host.app, nondum.host.peers.peer_services
print(json.dumps(sorted(sys.modules)))
"""


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="nondum-") as name:
        yield Path(name)


@pytest.fixture(scope="module")
def modules() -> set[str]:
    """What a daemon has imported before it does anything."""
    command = [sys.executable, "-I", "-c", IMPORTED]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return set(json.loads(said))


def test_daemon_imports_no_distribution_that_is_not_listed(modules: set[str]) -> None:
    roots = {name.partition(".")[0] for name in modules}
    site = {path.name.partition(".")[0] for path in _site_packages()}
    assert roots & site - OF_TOOLS - {"nondum"} <= OTHERS


def test_daemon_imports_nothing_heavy(modules: set[str]) -> None:
    assert not modules & HEAVY


def test_daemon_imports_few_modules(modules: set[str]) -> None:
    assert len([name for name in modules if name.partition(".")[0] != "nondum"]) <= MODULES


@pytest.mark.daemon
def test_host_keeps_to_its_memory(folder: Path) -> None:
    with running(folder) as (pid, _):
        assert probe.memory(pid)["daemon"][0] * 1024 <= DAEMON_MB * MB
        make_payload(folder / "stick", talker())
        (folder / "stick").rename(folder / "slots/stick")
        await_worker(pid)
        taken = probe.memory(pid)
    assert max(taken["worker"]) * 1024 <= WORKER_MB * MB
    assert taken["daemon"][0] * 1024 <= DAEMON_MB * MB, "with one payload it is much the same"


@pytest.mark.daemon
def test_host_with_little_memory_keeps_nothing_ready(folder: Path) -> None:
    """What its children are forked from is there as it starts, and ends by itself."""
    with running(folder, ready_above_mb=10**9) as (pid, _):
        assert probe.memory(pid).keys() <= {"daemon", "drive child"}
    with running(folder) as (pid, _):
        assert probe.memory(pid).keys() >= {"daemon", "worker"}


def test_page_is_what_was_measured() -> None:
    before = report.PAGE.read_text(encoding="utf-8")
    assert report.page(results.kept()) == before


def _site_packages() -> Iterator[Path]:
    for place in map(Path, sys.path):
        if place.name == "site-packages":
            yield from place.iterdir()
