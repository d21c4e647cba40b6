"""The kernel holds a child to what its job may use."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
import textwrap

import pytest

from nondum.host.jobs.allowance import ALLOWANCES, DESCRIPTORS, FILE_BYTES, allowed
from nondum.host.jobs.table import JOBS, find


def in_a_process(code: str) -> subprocess.CompletedProcess[str]:
    """Run code in a separate interpreter, which may die of it."""
    text = "from nondum.host.jobs import allowance\n" + textwrap.dedent(code)
    command = [sys.executable, "-c", text]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_job_that_takes_more_memory_gets_an_error() -> None:
    ran = in_a_process("""
        with allowance.allowed("look"):
            try:
                bytearray(allowance.ALLOWANCES["look"].memory_mb * 2**21)
            except MemoryError:
                print("refused")
        print(len(bytearray(allowance.ALLOWANCES["look"].memory_mb * 2**20)) // 2**20)
    """)
    assert ran.stdout.split() == ["refused", str(ALLOWANCES["look"].memory_mb)]


def test_job_that_computes_for_ever_is_ended() -> None:
    ran = in_a_process("""
        allowance.ALLOWANCES = {"look": allowance.Allowance(cpu_s=1, memory_mb=64)}
        with allowance.allowed("look"):
            while True:
                pass
    """)
    assert ran.returncode == -signal.SIGXCPU


def test_process_is_held_for_good() -> None:
    ran = in_a_process("""
        import resource
        allowance.confine_process()
        for limit in (resource.RLIMIT_NOFILE, resource.RLIMIT_FSIZE, resource.RLIMIT_CORE):
            print(*resource.getrlimit(limit))
    """)
    told = [[int(number) for number in line.split()] for line in ran.stdout.splitlines()]
    assert told == [[most, most] for most in (DESCRIPTORS, FILE_BYTES, 0)]


@pytest.mark.parametrize("job", ["look", "anything"])
def test_limits_of_a_job_end_with_it(job: str) -> None:
    kinds = (resource.RLIMIT_CPU, resource.RLIMIT_DATA)
    before = [resource.getrlimit(kind) for kind in kinds]
    with allowed(job):
        inside = [resource.getrlimit(kind) for kind in kinds]
        assert all(soft > 0 for soft, _ in inside)
        assert [hard for _, hard in inside] == [hard for _, hard in before]
    assert [resource.getrlimit(kind) for kind in kinds] == before


def test_every_job_that_reads_drives_is_limited() -> None:
    assert ALLOWANCES.keys() <= JOBS.keys()
    assert ALLOWANCES.keys() >= {"look", "copy", "verify", "hand_over", "outline", "judge"}


@pytest.mark.parametrize("job", JOBS)
def test_every_job_is_there(job: str) -> None:
    assert find(job).__doc__
