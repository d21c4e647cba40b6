"""The arithmetic and the tables of benchmarks/recompose; no test asserts its times."""

from __future__ import annotations

import doctest
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from benchmarks.recompose import processes, report, spreads
from benchmarks.recompose.insertion import PHASES, Insertion, Memory
from benchmarks.recompose.results import FIRST, KNOWN, LOAD, START, Container, Findings, Results

WORKED_S = 0.2


def insertion(ready_s: float) -> Insertion:
    return Insertion(ready_s, ready_s + 0.01, {phase: ready_s for phase in PHASES})


def findings(first_s: float, known_s: float, *, with_containers: bool = True) -> Findings:
    found = Findings("small", "libraries", {"payload": 2_000_000})
    found.insertions = {FIRST: [insertion(first_s)] * 3, KNOWN: [insertion(known_s)] * 3}
    found.memory = [Memory(30.0, 20.0, 40.0)]
    if with_containers:
        found.bytes["image"] = 80_000_000
        found.starts_s = {LOAD: [1.0, 1.0, 2.0], START: [0.1, 0.2, 0.2]}
        found.containers = [Container(19.0, 1.1)]
    return found


def row_of(text: str, *words: str) -> str:
    (row,) = (line for line in text.splitlines() if all(word in line for word in words))
    return row


@pytest.mark.parametrize("module", [spreads, report, processes], ids=lambda module: module.__name__)
def test_examples_are_true(module: ModuleType) -> None:
    assert doctest.testmod(module).failed == 0


def test_ratios_are_formed_round_by_round() -> None:
    assert spreads.ratios([1.0, 8.0, 3.0], [2.0, 4.0, 3.0]) == spreads.Spread(1.0, 0.5, 2.0, 3)


def test_report_judges_each_aim() -> None:
    text = report.as_markdown(Results(("a machine",), (findings(0.15, 0.3),)))
    assert row_of(text, "small", FIRST, "≤ 0.2").endswith("yes |")
    assert row_of(text, "small", KNOWN, "≤ 0.1").rstrip("| ").endswith("NO")


def test_known_payload_must_not_start_slower_than_a_container() -> None:
    quick = findings(0.15, 0.09)
    quick.starts_s[START] = [0.08, 0.08, 0.08]
    text = report.as_markdown(Results((), (quick,)))
    assert row_of(text, KNOWN, "≤ 0.1, ≤ 1").rstrip("| ").endswith("NO")


def test_report_without_containers_says_why() -> None:
    alone = findings(0.15, 0.09, with_containers=False)
    text = report.as_markdown(Results((), (alone,), missing="that needs root"))
    assert "No container was measured: that needs root" in text
    assert row_of(text, FIRST, "≤ 0.2").rstrip("| ").endswith("?")
    assert "podman" not in row_of(text, "worker")


@pytest.fixture
def child() -> Iterator[subprocess.Popen[bytes]]:
    """A process that has computed for `WORKED_S`, and waits."""
    works = f"while time.process_time() < {WORKED_S}: pass"
    program = f"import sys, time\n{works}\nprint(flush=True); sys.stdin.read()"
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", program], stdin=pipe, stdout=pipe) as started:
        assert started.stdout is not None
        started.stdout.readline()
        yield started
        started.communicate()


def test_ticks_count_every_processor(tmp_path: Path) -> None:
    (tmp_path / "stat").write_text("cpu  10 0 5 100 3 0 2 0 0 0\ncpu0 1 0\n", encoding="utf-8")
    assert processes.processor_ticks(tmp_path) == (103, 120)


def test_memory_and_time_of_a_real_process(child: subprocess.Popen[bytes]) -> None:
    assert child.pid in set(processes.descendants(os.getpid()))
    assert 1 < processes.pss_mb(child.pid) < 100
    assert processes.cpu_s(child.pid) > WORKED_S / 2, "the kernel counts in ticks"
    processes.await_rest(child.pid, timeout_s=30)
