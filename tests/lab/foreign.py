"""Programs of another processor, run on this machine: needed to build a root file system for it.

The kernel passes them to a user-mode QEMU; see its Documentation/admin-guide/binfmt-misc.rst.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from tests.lab.cache import call
from tests.lab.recipe import Recipe

FORMATS = Path("/proc/sys/fs/binfmt_misc")
KEPT = Path("/run/nondum-lab/binfmt_misc")
"""Where it stays mounted, so that the kernel keeps what it was told: something mounted below /proc
changes what the sandboxes of workers may mount (mount_namespaces(7))."""


def see_it_run(recipe: Recipe) -> None:
    """Have the kernel run programs of a recipe's architecture, unless it does so anyway.

    Raises `RuntimeError` when it cannot be had to.
    """
    if _runs(recipe):
        return
    was_there = (FORMATS / "register").exists()
    if not was_there:
        call("mount", "-t", "binfmt_misc", "none", FORMATS)
    call("update-binfmts", "--enable", f"qemu-{recipe.architecture}")
    if not was_there:
        KEPT.mkdir(parents=True, exist_ok=True)
        call("mount", "-t", "binfmt_misc", "none", KEPT)
        call("umount", FORMATS)
    if not _runs(recipe):
        raise RuntimeError(f"programs of {recipe.debian} do not run here, even under qemu-user")


def _runs(recipe: Recipe) -> bool:
    native = call("dpkg", "--print-architecture").strip() == recipe.debian
    return native or subprocess.run(["arch-test", recipe.debian], stdout=-3).returncode == 0
