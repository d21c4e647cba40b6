"""The attempts to break out are made in a machine of the laboratory, too, by what is sent there."""

from __future__ import annotations

import io
import subprocess
import sys
import tarfile
from pathlib import Path

from tests.lab.scenarios.escape import packed


def test_what_is_sent_to_a_machine_is_all_that_the_attempts_need(tmp_path: Path) -> None:
    with tarfile.open(fileobj=io.BytesIO(packed())) as archive:
        archive.extractall(tmp_path, filter="data")
    program = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import tests.sandbox.table"
    told = subprocess.run(
        [sys.executable, "-P", "-c", f"{program} as table; print(table.__file__)"],
        cwd=tmp_path,
        env={},
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stderr
    assert told.stdout.strip() == str(tmp_path / "tests/sandbox/table.py")
