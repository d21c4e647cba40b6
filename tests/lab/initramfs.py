"""A small initramfs: a static busybox, and the few kernel modules that lead to the disk."""

from __future__ import annotations

import gzip
import lzma
import subprocess
from pathlib import Path

from tests.lab.cache import call
from tests.lab.recipe import INSIDE

WANTED = ("virtio_pci", "virtio_blk", "ext4")
PACKED = ".xz"
"""What the names of packed modules end with."""


def write_initramfs(root: Path, version: str, target: Path) -> None:
    """Pack one for the kernel `version` of a root file system."""
    order = _modules(root, version)
    names = [path.name.removesuffix(PACKED) for path in order]
    files = {
        "init": (INSIDE / "init").read_bytes(),
        "busybox": (root / "bin/busybox").read_bytes(),
        "modules/order": "".join(f"{name}\n" for name in names).encode(),
        **{f"modules/{path.name.removesuffix(PACKED)}": _unpacked(path) for path in order},
    }
    work = target.with_suffix(".tree")
    for name, data in files.items():
        path = work / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
        path.chmod(0o755)
    listed = "\n".join(["modules", *files]).encode()
    packed = subprocess.run(
        ["cpio", "--quiet", "-o", "-H", "newc"], cwd=work, input=listed, stdout=-1, check=True
    ).stdout
    target.write_bytes(gzip.compress(packed, 6))
    call("rm", "-r", work)


def _unpacked(module: Path) -> bytes:
    """busybox inserts what the kernel can take as it is; Debian 13 packs modules."""
    data = module.read_bytes()
    return lzma.decompress(data) if module.suffix == PACKED else data


def _modules(root: Path, version: str) -> list[Path]:
    """Module files in the order in which they are to be inserted."""
    found: dict[Path, None] = {}
    for module in WANTED:
        said = call("modprobe", "-d", root, "-S", version, "--show-depends", module)
        for line in said.splitlines():
            if line.startswith("insmod "):
                found.setdefault(Path(line.split()[1]))
    return list(found)
