"""Copies of this checkout, as others have them: elsewhere, with other modes and times of files."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from tests.packages.conftest import ROOT


def copied(folder: Path, *, umask: int, time_s: int) -> Path:
    """Copy what is in the checkout, and would be committed, into a folder that is made."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    said = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout
    before = os.umask(umask)
    try:
        for name in said.decode().split("\0"):
            source, target = ROOT / name, folder / name
            if name and source.is_file():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
                target.chmod((0o777 if os.access(source, os.X_OK) else 0o666) & ~umask)
                os.utime(target, (time_s, time_s))
    finally:
        os.umask(before)
    return folder
