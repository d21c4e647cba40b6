"""What a plugin says of itself, asked in a child process that has its wheels and nothing else."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import PayloadRefused, Problem, WorkerFailed

TIMEOUT_S = 60

# Like a worker: no site, no environment; `.pth` files are not read, since `site` is not loaded.
# What a plugin prints goes to standard error: standard output is the answer's alone.
_CHILD = """
import json, os, sys
answer = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
sys.path.append(sys.argv[1])
from nondum.sdk.errors import NondumError
from nondum.sdk.plugin import describe, load
try:
    said = {"description": describe(load(sys.argv[2], sys.argv[3])).to_dict()}
except NondumError as error:
    said = {"problems": [problem.to_dict() for problem in error.problems]}
json.dump(said, answer)
answer.flush()
"""


def describe(site_packages: Path, entry_point: str, distribution: str) -> PluginDescription:
    """Import a plugin and ask its describing hooks.

    Raises `PayloadRefused` with what the plugin did wrong (IMPORT_FAILED, HOOK_FAILED, …), or
    DESCRIBE_HANGS, DESCRIBE_FAILED.
    """
    python = Path(sys.base_prefix) / "bin" / f"python3.{sys.version_info.minor}"
    executable = python if python.exists() else Path(sys.executable)
    command = [executable, "-I", "-S", "-c", _CHILD, site_packages, entry_point, distribution]
    try:
        done = subprocess.run(
            [str(part) for part in command],
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        text = f"the plugin did not describe itself in {TIMEOUT_S} s"
        raise PayloadRefused(Problem("DESCRIBE_HANGS", text, where=distribution)) from error
    try:
        said = json.loads(done.stdout)
    except ValueError as error:
        last = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        text = f"the plugin ended while it described itself: {last}"
        raise PayloadRefused(Problem("DESCRIBE_FAILED", text, where=distribution)) from error
    if "problems" in said:
        raise PayloadRefused(*(Problem(**problem) for problem in said["problems"]))
    try:
        return PluginDescription.parse(said["description"], where=distribution)
    except WorkerFailed as error:
        raise PayloadRefused(*error.problems) from error
