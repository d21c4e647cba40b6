"""Builds a machine's disk: Debian by mmdebstrap, the kernel unpacked beside it, one ext4 image.

Needs root, and no loop device: `mkfs.ext4 -d` fills the image.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from tests.lab.cache import call, kept
from tests.lab.foreign import see_it_run
from tests.lab.initramfs import write_initramfs
from tests.lab.recipe import INSIDE, Recipe

AGENT = "usr/lib/nondum-lab/agent.py"
UNIT = "nondum-lab.service"
UNWANTED = ("apt-daily.timer", "apt-daily-upgrade.timer", "e2scrub_reap.service")


@dataclass(frozen=True, slots=True)
class Built:
    """What a machine is started from; never written to."""

    recipe: Recipe
    folder: Path

    @property
    def disk(self) -> Path:
        """Its disk, raw."""
        return self.folder / "disk.img"

    @property
    def root(self) -> Path:
        """The same files as a folder, to run programs in before there is a machine."""
        return self.folder / "root"

    @property
    def kernel(self) -> Path:
        """The kernel."""
        return self.root / "boot/vmlinuz"

    @property
    def initramfs(self) -> Path:
        """What the kernel starts with."""
        return self.folder / "initramfs.gz"


def built(recipe: Recipe) -> Built:
    """The machine of a recipe, from the cache or built now (a minute; ten, where the machine that
    it is built on has another processor)."""
    see_it_run(recipe)
    return Built(recipe, kept(f"{recipe.name}-{recipe.key}", lambda f: _build(recipe, f)))


def _build(recipe: Recipe, folder: Path) -> None:
    root = folder / "root"
    _bootstrap(recipe, root)
    _settle(root)
    version = (root / "boot/version").read_text().strip()
    write_initramfs(root, version, folder / "initramfs.gz")
    make_disk(root, folder / "disk.img", recipe.disk_mb, label="root")


def make_disk(tree: Path, image: Path, size_mb: int, *, label: str) -> None:
    """Write an ext4 image that holds a folder's files."""
    options = ("-q", "-F", "-m", "0", "-L", label, "-d", tree)
    call("mkfs.ext4", *options, image, f"{size_mb}M")


def _bootstrap(recipe: Recipe, root: Path) -> None:
    call(
        "mmdebstrap",
        "--quiet",
        "--mode=root",
        "--variant=minbase",
        f"--architectures={recipe.debian}",
        f"--include={','.join(recipe.packages)}",
        *(f"--dpkgopt=path-exclude={pattern}" for pattern in recipe.without),
        f"--customize-hook={INSIDE / 'fetch-kernel'}",
        recipe.suite,
        root,
        env={"KERNEL": recipe.kernel, "MODULES_WITHOUT": " ".join(recipe.modules_without)},
    )


def _settle(root: Path) -> None:
    """Give it a name, the laboratory's agent, a shell on its terminal, and nothing to wait for."""
    (root / "etc/hostname").write_text("spot\n")
    (root / "etc/hosts").write_text("127.0.0.1 localhost spot\n::1 localhost\n")
    (root / "etc/fstab").write_text("/dev/vda / ext4 errors=remount-ro 0 1\n")
    (root / "opt/nondum").mkdir()
    agent = root / AGENT
    agent.parent.mkdir()
    shutil.copy(INSIDE / "agent.py", agent)
    shutil.copy(INSIDE / UNIT, root / "etc/systemd/system" / UNIT)
    call("systemctl", "--root", root, "enable", UNIT)
    call("systemctl", "--root", root, "mask", *UNWANTED)
    call("passwd", "--root", root, "--delete", "root")
