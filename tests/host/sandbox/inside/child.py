"""A separate process that gives up what a test says, and tells what it still has."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

PATIENCE_S = 60.0
BEFORE = """
import errno, json, os, resource, signal, sys
from pathlib import Path
from nondum.host.sandbox.inside import kernel, limits, mounts, restrict

given = json.loads(sys.argv[1])

def tell(what):
    print(json.dumps(what), flush=True)

def failure(do):
    try:
        do()
    except OSError as error:
        return errno.errorcode[error.errno]
    return ""

def status():
    lines = Path("/proc/self/status").read_text().splitlines()
    return dict(line.split(":\\t", 1) for line in lines if ":\\t" in line)
"""


def told(program: str, given: Any = None) -> Any:
    """What a program tells; `given` is there for it."""
    words = [sys.executable, "-c", BEFORE + program, json.dumps(given)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
