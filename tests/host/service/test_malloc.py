"""What a daemon frees is free again for others, however often it had it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

MAPPED = """
import ctypes, sys
from nondum.host.service import malloc

class Said(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in "abcdefghij"]

def mapped():
    return libc.mallinfo2().e

libc = ctypes.CDLL(None)
libc.mallinfo2.restype = Said
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]
if sys.argv[1] == "steady":
    malloc.give_back_what_is_big()
libc.free(libc.malloc(4_000_000))
before = mapped()
libc.malloc(2_000_000)
print(mapped() - before > 1_000_000)
"""
"""After a big block was freed, is the next one mapped, too?"""


@pytest.mark.parametrize(("how", "is_mapped"), [("steady", "True"), ("as it is", "False")])
def test_big_block_is_mapped_though_one_was_freed(how: str, is_mapped: str) -> None:
    command = [sys.executable, "-c", MAPPED, how]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == is_mapped


DAEMON = """
import asyncio, gc, os, signal, sys
from pathlib import Path
from nondum.host.app import run_host
from nondum.host.config.host_config import user_config
from nondum.host.config.parsing import load

class Looker:
    kind = "looker"

    async def watch(self, emit):
        frozen = gc.get_freeze_count()
        gc.collect()
        print(frozen, len(gc.get_objects()))
        os.kill(os.getpid(), signal.SIGTERM)
        await asyncio.Event().wait()

asyncio.run(run_host(load(Path(sys.argv[1]), user_config()), more_drives=[Looker()]))
"""


def test_full_collection_of_a_daemon_passes_over_its_modules(tmp_path: Path) -> None:
    config = tmp_path / "nondum.toml"
    config.write_text(
        f'[host]\nname = "rover"\nstate = "{tmp_path}/state"\n'
        f'control = "{tmp_path}/control"\n[peers]\nenabled = false\n'
        "[drives]\nblock_devices = false\n[devices]\nudev = false\n"
    )
    command = [sys.executable, "-c", DAEMON, str(config)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    kept, looked_through = map(int, done.stdout.split())
    assert kept > 4 * looked_through, (kept, looked_through)
