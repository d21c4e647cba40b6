"""Containers as a fleet would run them: podman, with a storage folder that lasts for one run."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

# What podman needs where it must not change cgroups or raise limits; harmless where it may.
_ENGINE = ("--runtime", "runc", "--cgroup-manager", "cgroupfs")
_RUN = ("--network=none", "--ulimit", "nofile=1024:1024", "--ulimit", "nproc=4096:4096")
_NAME = "nondum-benchmark"
READY = b"READY\n"
"""What a container prints once its plugin has described itself."""


@dataclass(frozen=True, slots=True)
class Container:
    """A running container that has said that it is ready."""

    client: subprocess.Popen[bytes]
    """The attached `podman run`."""
    ready_s: float
    """When it said so, on the monotonic clock."""
    pid: int
    conmon_pid: int


class Podman:
    """Loads and runs images in a storage that nothing else uses."""

    def __init__(self, storage: Path) -> None:
        # Under /run, since socket paths below it must stay short.
        roots = ("--root", str(storage), "--runroot", "/run/nondum-benchmark")
        self._command = ("podman", *roots, "--storage-driver", "overlay", *_ENGINE)

    def make_image(self, rootfs: Path, command: tuple[str, ...], image: str, tar: Path) -> None:
        """Make an image of one layer from a root file system, saved to `tar` and not kept."""
        change = f"CMD {json.dumps(command)}"
        with subprocess.Popen(["tar", "-C", rootfs, "-c", "."], stdout=subprocess.PIPE) as packer:
            importing = [*self._command, "import", "--quiet", "--change", change, "-", image]
            subprocess.run(importing, stdin=packer.stdout, stdout=subprocess.DEVNULL, check=True)
        self._run("save", "--quiet", "--output", str(tar), image)
        self.forget(image)

    def load(self, tar: Path) -> None:
        """Take an image in."""
        self._run("load", "--quiet", "--input", str(tar))

    def forget(self, image: str) -> None:
        """Delete an image, so that the next load does all the work again."""
        self._run("rmi", "--force", image)

    @contextmanager
    def running(self, image: str) -> Iterator[Container]:
        """A container of a loaded image, from the moment that it is ready. Removed at the end."""
        client = subprocess.Popen(
            [*self._command, "run", "--rm", "--name", _NAME, *_RUN, image],
            stdout=subprocess.PIPE,
        )
        assert client.stdout is not None  # a pipe was asked for
        try:
            said = client.stdout.readline()
            ready_s = time.monotonic()
            if said != READY:
                raise RuntimeError(f"the container of {image} said {said!r} instead of ready")
            yield Container(client, ready_s, *self._pids())
        finally:
            self._run("rm", "--force", "--time", "0", "--ignore", _NAME)
            client.wait()
            client.stdout.close()

    def _pids(self) -> tuple[int, int]:
        wanted = "{{.State.Pid}} {{.State.ConmonPid}}"
        pid, conmon = self._run("inspect", "--format", wanted, _NAME).split()
        return int(pid), int(conmon)

    def _run(self, *arguments: str) -> str:
        done = subprocess.run(
            [*self._command, *arguments], capture_output=True, text=True, check=False
        )
        if done.returncode:
            raise RuntimeError(f"podman {arguments[0]}: {done.stderr.strip()}")
        return done.stdout
