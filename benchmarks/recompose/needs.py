"""What the container half needs of the machine, installed where that may be done."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping

from benchmarks.recompose.image import PYTHON

TO_RUN = {"podman": "podman", "runc": "runc"}
TO_BUILD = {**TO_RUN, "mmdebstrap": "mmdebstrap"}
"""Command → Debian package."""


def lacking(commands: Mapping[str, str]) -> str:
    """Why containers cannot be measured here, after trying to make it possible; empty: they can."""
    if sys.version_info[:2] != PYTHON:
        return f"the image has Python {PYTHON[0]}.{PYTHON[1]}; run this with the same"
    packages = _missing(commands)
    install = f"apt-get install {' '.join(packages)}"
    if os.geteuid() != 0:
        return "that needs root" + (f", and {install}" if packages else "")
    if packages and shutil.which("apt-get"):
        subprocess.run(["apt-get", "update", "-qq"], check=False)
        quiet = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        subprocess.run([*install.split(), "-qq", "-y"], check=False, env=quiet)
        packages = _missing(commands)
    return f"{', '.join(packages)} cannot be installed here" if packages else ""


def _missing(commands: Mapping[str, str]) -> list[str]:
    path = os.environ.get("PATH", os.defpath) + ":/usr/sbin:/sbin"
    return [package for name, package in commands.items() if not shutil.which(name, path=path)]
