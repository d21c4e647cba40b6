"""What takes too much to read dies of it in a copy, and the process that asked goes on."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

from nondum.host.jobs import forked_trial
from nondum.sdk.errors import PayloadRefused, Problem


def tried(work: str) -> str:
    """What trying some work comes to, in an interpreter with one thread."""
    code = f"""
        from nondum.host.jobs import forked_trial
        from nondum.sdk.errors import NondumError, PayloadRefused, Problem

        def work():
            {work}

        try:
            forked_trial.run(work, "org.example.lamp")
            print("done")
        except NondumError as error:
            print(*(problem.code for problem in error.problems))
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    return done.stdout.strip()


@pytest.mark.parametrize(
    ("work", "told"),
    [
        ("pass", "done"),
        ("raise PayloadRefused(Problem('A', 'a'), Problem('B', 'b'))", "A B"),
        ("raise ValueError('a fault of ours: it comes again without limits')", "done"),
        ("bytearray(forked_trial.MEMORY_BYTES * 2)", "METADATA_LIMIT"),
        ("bytearray(forked_trial.MEMORY_BYTES // 2)", "done"),
        ("exec('while True: pass')", "METADATA_LIMIT"),
        ("__import__('os')._exit(9)", "METADATA_LIMIT"),
        ("__import__('os').abort()", "METADATA_LIMIT"),
    ],
    ids=["nothing", "refused", "fault", "memory", "little-memory", "endless", "exit", "crash"],
)
def test_trial_comes_to(work: str, told: str) -> None:
    assert tried(work) == told


def test_problems_come_back_whole() -> None:
    problem = Problem("CODE", "text", "where", "need", "have", "fix")

    def work() -> None:
        raise PayloadRefused(problem)

    with pytest.raises(PayloadRefused) as refused:
        forked_trial.run(work, "org.example.lamp")
    assert refused.value.problems == (problem,)
