"""What a job in a child process may use of the machine, enforced by the kernel (setrlimit(2))."""

from __future__ import annotations

import contextlib
import math
import re
import resource
from collections.abc import Iterator, Mapping
from pathlib import Path

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.contents import MAX_FILE_BYTES, MAX_FILES

_MB = 1024 * 1024


@frozen
class Allowance:
    """The most that one job may take."""

    cpu_s: int
    """Processor time; then the process is ended by SIGXCPU."""
    memory_mb: int
    """Data, beyond what the process had before; then there is a `MemoryError`."""


ALLOWANCES: Mapping[str, Allowance] = {
    "look": Allowance(cpu_s=10, memory_mb=128),
    "outline": Allowance(cpu_s=10, memory_mb=128),
    "copy": Allowance(cpu_s=3600, memory_mb=256),
    "hand_over": Allowance(cpu_s=3600, memory_mb=256),
    "judge": Allowance(cpu_s=60, memory_mb=256),
    "verify": Allowance(cpu_s=300, memory_mb=512),
}
"""Of the jobs that read what strangers wrote before it is checked."""

OTHERWISE = Allowance(cpu_s=3600, memory_mb=1536)

DESCRIPTORS = 2 * MAX_FILES
"""All wheels of a payload may be open at once, and what is written of them."""
ADDRESS_SPACE = 2 * 1024**3
FILE_BYTES = MAX_FILE_BYTES + 1
"""One byte more than any file of a payload may have."""


def confine_process() -> None:
    """Set, for good, what no job of this process may go beyond. No core is dumped."""
    for limit, most in (
        (resource.RLIMIT_AS, ADDRESS_SPACE),
        (resource.RLIMIT_NOFILE, DESCRIPTORS),
        (resource.RLIMIT_FSIZE, FILE_BYTES),
        (resource.RLIMIT_CORE, 0),
    ):
        set_limit(limit, most, for_good=True)


@contextlib.contextmanager
def allowed(job: str) -> Iterator[None]:
    """Hold this process to what a job may use, as long as it is at it."""
    allowance = ALLOWANCES.get(job, OTHERWISE)
    set_limit(resource.RLIMIT_CPU, math.ceil(_cpu_s()) + allowance.cpu_s)
    set_limit(resource.RLIMIT_DATA, data_bytes() + allowance.memory_mb * _MB)
    try:
        yield
    finally:
        for limit in (resource.RLIMIT_CPU, resource.RLIMIT_DATA):
            set_limit(limit, resource.RLIM_INFINITY)


def set_limit(limit: int, most: int, *, for_good: bool = False) -> None:
    """Set a limit as far as the hard one lets it; `for_good`: lower that, too."""
    _, hard = resource.getrlimit(limit)
    soft = most if hard == resource.RLIM_INFINITY else hard
    if most != resource.RLIM_INFINITY:
        soft = min(soft, most)
    resource.setrlimit(limit, (soft, soft if for_good else hard))


def data_bytes() -> int:
    """What this process has of what RLIMIT_DATA counts."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    found = re.search(r"^VmData:\s+(\d+) kB", status, re.MULTILINE)
    return int(found[1]) * 1024 if found else 0


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
