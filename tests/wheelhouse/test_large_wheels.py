"""Wheels are unpacked in a process that may have less address space than they have bytes.

The limits are the product's, lowered in proportion: what is asked is that the size and number of
wheels do not count, not how large they are.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.payloads import make_wheel, sha256
from tests.wheelhouse.hostile_wheels import INFO, METADATA, WHEEL, record_of

from nondum.wheelhouse.format.contents import MAX_FILES

MEGABYTE = 1024 * 1024
SPARE = 128 * MEGABYTE
"""Address space beyond what the process has: threads, their stacks and buffers fit into it."""
CHILD = """
import json, re, sys
from pathlib import Path
from nondum.host.jobs import allowance
from nondum.wheelhouse.store.store import Store

store, spare, *wheels = json.loads(sys.argv[1])
if spare:
    status = Path("/proc/self/status").read_text()
    allowance.ADDRESS_SPACE = int(re.search(r"VmSize:\\s+(\\d+)", status)[1]) * 1024 + spare
allowance.confine_process()
with allowance.allowed("install"):
    stored = Store(Path(store)).add_all([(Path(path), sha256) for path, sha256 in wheels])
print(json.dumps([wheel.size for wheel in stored]))
"""


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    """A folder for large files, which are deleted at once."""
    yield tmp_path
    for path in tmp_path.rglob("*"):
        if path.is_file() and path.stat().st_size > MEGABYTE:
            path.unlink()


def large_wheel(folder: Path, name: str, size: int, *, zip64: bool = False) -> Path:
    """A wheel with one stored member of `size` bytes, and the metadata that it needs."""
    path = folder / f"{name}-1.0-py3-none-any.whl"
    info = INFO.replace("evil", name)
    files = {
        f"{name}/data.bin": bytes(size),
        f"{info}/METADATA": METADATA.replace(b"evil", name.encode()),
        f"{info}/WHEEL": WHEEL,
    }
    files[f"{info}/RECORD"] = record_of(files, f"{info}/RECORD")
    with zipfile.ZipFile(path, "w") as archive:
        for member, data in files.items():
            told = zipfile.ZipInfo(member, (2026, 1, 1, 0, 0, 0))
            with archive.open(told, "w", force_zip64=zip64) as file:
                file.write(data)
    return path


def stored_by_child(store: Path, wheels: list[Path], *, spare: int = SPARE) -> list[int]:
    """Have a process that is confined as those that install store wheels; their sizes."""
    told = json.dumps([str(store), spare, *((str(path), sha256(path)) for path in wheels)])
    done = subprocess.run(
        [sys.executable, "-c", CHILD, told],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MALLOC_ARENA_MAX": "1"},
    )
    assert done.returncode == 0, done.stderr
    sizes: list[int] = json.loads(done.stdout)
    return sizes


def test_wheels_that_are_together_larger_than_the_address_space(folder: Path) -> None:
    wheels = [large_wheel(folder, f"part{n}", SPARE // 2) for n in range(3)]
    assert all(size > SPARE // 2 for size in stored_by_child(folder / "store", wheels))


@pytest.mark.parametrize("zip64", [False, True], ids=["plain", "zip64"])
def test_one_wheel_that_is_larger_than_the_address_space(folder: Path, zip64: bool) -> None:
    wheel = large_wheel(folder, "whole", SPARE * 3 // 2, zip64=zip64)
    (size,) = stored_by_child(folder / "store", [wheel])
    assert size > SPARE * 3 // 2


def test_as_many_wheels_as_a_payload_may_have(folder: Path) -> None:
    wheels = [make_wheel(folder, f"part{n}", "1.0", {f"part{n}.py": ""}) for n in range(MAX_FILES)]
    assert len(stored_by_child(folder / "store", wheels, spare=0)) == MAX_FILES
