"""What a machine is made of: its architecture, its system's packages, and how QEMU runs it."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

HERE = Path(__file__).parent
INSIDE = HERE / "inside"
"""Files that go into the root file system as they are."""

PACKAGES = (
    *("systemd", "systemd-sysv", "udev", "dbus", "kmod", "procps", "util-linux", "iproute2"),
    *("python3", "python3-venv", "bubblewrap", "libseccomp2", "busybox-static"),
    *("e2fsprogs", "dosfstools", "usbutils", "libusb-1.0-0", "strace"),
)
WITHOUT = (
    *("/usr/share/doc/*", "/usr/share/man/*", "/usr/share/locale/*", "/usr/share/info/*"),
    *("/usr/share/lintian/*", "/usr/share/bug/*"),
)
"""What dpkg leaves out: it is not needed there."""
MODULES_WITHOUT = (
    *("drivers/gpu", "drivers/infiniband", "drivers/net/ethernet", "drivers/net/wireless"),
    *("drivers/isdn", "drivers/atm", "drivers/staging", "drivers/iio", "sound/soc", "sound/pci"),
)
"""Folders of kernel modules for hardware that QEMU does not have."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """One kind of machine. Two recipes that are equal make the same machine."""

    name: str
    """Its processor's, as `uname -m` says, and its system's unless that is Debian 12."""
    debian: str
    """Debian's name of the architecture."""
    kernel: str
    """The metapackage of its kernel."""
    program: str
    """The QEMU that runs it."""
    machine: tuple[str, ...]
    """Board and processor, as arguments of that."""
    terminal: str
    """The device of its first serial line."""
    slowness: float = 1.0
    """What time-outs are multiplied by; nothing else depends on it."""
    suite: str = "bookworm"
    packages: tuple[str, ...] = PACKAGES
    without: tuple[str, ...] = WITHOUT
    modules_without: tuple[str, ...] = MODULES_WITHOUT
    disk_mb: int = 3072
    """Size of its disk, most of it free."""

    @property
    def architecture(self) -> str:
        """As `uname -m` says."""
        return MACHINES[self.debian]

    @property
    def python(self) -> str:
        """The version of its Python: `3.11`."""
        return PYTHONS[self.suite]

    @property
    def key(self) -> str:
        """A hash of all that its root file system is made of."""
        parts = [json.dumps(self._of_root, sort_keys=True).encode()]
        sources = [HERE / "building.py", HERE / "initramfs.py", *sorted(INSIDE.rglob("*"))]
        parts += [f.read_bytes() for f in sources if f.is_file()]
        return hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]

    @property
    def _of_root(self) -> dict[str, object]:
        """Those of its fields that its root file system depends on."""
        return {name: value for name, value in asdict(self).items() if name not in HOW_IT_IS_RUN}


MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}
PYTHONS = {"bookworm": "3.11", "trixie": "3.13"}
"""Debian's releases 12 and 13, by the names of their suites."""
HOW_IT_IS_RUN = frozenset({"program", "machine", "terminal", "slowness"})
WITHOUT_AVX = "avx=off,avx2=off,f16c=off,fma=off"
"""QEMU emulates AVX value by value: by SSE (x86-64-v2, what numpy and OpenCV ask for at least) a
thermal image takes a third of the time."""
X86_64 = Recipe(
    name="x86_64",
    debian="amd64",
    kernel="linux-image-amd64",
    program="qemu-system-x86_64",
    machine=("-machine", "q35", "-cpu", f"max,{WITHOUT_AVX}"),
    terminal="ttyS0",
)
AARCH64 = Recipe(
    name="aarch64",
    debian="arm64",
    kernel="linux-image-arm64",
    program="qemu-system-aarch64",
    machine=("-machine", "virt", "-cpu", "cortex-a72"),
    terminal="ttyAMA0",
    slowness=3.0,
)
"""Stands for a Raspberry Pi 4 of 2 GB with its system: processor and memory, not its devices."""
ARCHITECTURES = {recipe.architecture: recipe for recipe in (X86_64, AARCH64)}


def recipe(architecture: str, suite: str = X86_64.suite) -> Recipe:
    """The machine of a processor with a release of Debian."""
    found = ARCHITECTURES[architecture]
    if suite == found.suite:
        return found
    return replace(found, name=f"{architecture}-{suite}", suite=suite)
