"""What a test leaves behind, since what would have ended it was removed, ends with the test."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.kit.processes import is_alive

ROOT = Path(__file__).parents[2]
LEAVES_PROCESSES = r'''
import os, subprocess, sys
from pathlib import Path

FORKS = """
import os, time
for _ in range(3):
    os.fork()
os.write(1, b"%d\\n" % os.getpid())
time.sleep(999)
"""

def test_leaves_processes():
    left = subprocess.Popen(
        [sys.executable, "-c", FORKS], stdout=subprocess.PIPE, start_new_session=True, text=True
    )
    Path("pids").write_text(" ".join(left.stdout.readline().strip() for _ in range(8)))
    raise ValueError
'''


def test_nothing_is_left_of_a_test_that_starts_sessions_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "test_it.py").write_text(LEAVES_PROCESSES)
    runner = subprocess.run(
        [sys.executable, "-m", "tests.mutation.runner"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        input=json.dumps(["test_it.py"]) + "\n",
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    assert json.loads(runner.stdout) == "test_it.py::test_leaves_processes"
    left = [int(pid) for pid in (tmp_path / "pids").read_text().split()]
    assert len(set(left)) == 8
    assert not [pid for pid in left if is_alive(pid)]
