"""Writes the lock again: uv resolves for all versions of Python and all machines at once."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from nondum_dev import asked
from nondum_dev.overruled import OVERRIDING
from nondum_dev.places import CHECKOUT, LOCK, PACKAGING
from nondum_dev.problem import SetUpFailed

HEAD = """\
# What `./run` and tox install that others wrote: exact versions, with hashes, for all versions of
# Python and all machines. Written by `./run lock`.
"""
OLDEST_PYTHON = "3.11"
OVERRIDES = "overrides.txt"


def relock(*, upgrade: bool) -> None:
    """Lock what is asked for: as it is locked now, or with `upgrade` in the newest versions."""
    with tempfile.TemporaryDirectory(prefix="nondum-lock-") as scratch:
        text = _compiled(_uv(Path(scratch)), Path(scratch), upgrade=upgrade)
    LOCK.write_text(HEAD + text, encoding="utf-8")


def _uv(scratch: Path) -> Path:
    """Install uv itself, from the lock, where nothing else is."""
    _call(sys.executable, "-m", "venv", scratch / "venv")
    programs = scratch / "venv/bin"
    _call(programs / "python", "-P", PACKAGING / "development", "install", "--group", "lock")
    return programs / "uv"


def _compiled(uv: Path, scratch: Path, *, upgrade: bool) -> str:
    (scratch / OVERRIDES).write_text("\n".join(OVERRIDING), encoding="utf-8")
    output = scratch / "output.txt"
    output.write_bytes(LOCK.read_bytes())
    _call(
        *(uv, "pip", "compile", "-", "-q", "-o", output, "--no-config", "--no-header"),
        *("--universal", "--python-version", OLDEST_PYTHON, "--fork-strategy", "fewest"),
        *("--generate-hashes", "--no-emit-index-url", "--override", OVERRIDES),
        *["--upgrade"] * upgrade,
        words="\n".join(asked.of_all(CHECKOUT)),
        folder=scratch,
    )
    return output.read_text(encoding="utf-8")


def _call(*command: str | Path, words: str = "", folder: Path = CHECKOUT) -> None:
    surroundings = dict(os.environ)
    if index := os.environ.get("PIP_INDEX_URL"):
        surroundings.setdefault("UV_DEFAULT_INDEX", index)
    done = subprocess.run(
        command, input=words, text=True, env=surroundings, cwd=folder, stdout=sys.stderr
    )
    if done.returncode != 0:
        raise SetUpFailed(f"{Path(command[0]).name} ended with {done.returncode}: see above")
