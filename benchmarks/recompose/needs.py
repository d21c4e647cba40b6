"""What the container half needs of the machine, installed where that may be done."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

from benchmarks.recompose.image import PYTHON

COMMANDS = {"podman": "podman", "runc": "runc", "mmdebstrap": "mmdebstrap"}
"""Command → Debian package."""


def lacking() -> str:
    """Why containers cannot be measured here, after trying to make it possible; empty: they can."""
    if sys.version_info[:2] != PYTHON:
        return f"the image has Python {PYTHON[0]}.{PYTHON[1]}; run this with the same"
    packages = _missing()
    install = f"apt-get install {' '.join(packages)}"
    if os.geteuid() != 0:
        return "that needs root" + (f", and {install}" if packages else "")
    if packages and shutil.which("apt-get"):
        subprocess.run(["apt-get", "update", "-qq"], check=False)
        quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        subprocess.run([*install.split(), "-qq", "-y"], check=False, env=quiet)
        packages = _missing()
    return f"{', '.join(packages)} cannot be installed here" if packages else ""


def _missing() -> list[str]:
    path = os.environ.get("PATH", os.defpath) + ":/usr/sbin:/sbin"
    return [package for name, package in COMMANDS.items() if not shutil.which(name, path=path)]
