"""What a daemon frees is free again for others, however often it had it."""

from __future__ import annotations

import subprocess
import sys

import pytest

MAPPED = """
import ctypes, sys
from nondum.host import heap

class Said(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in "abcdefghij"]

def mapped():
    return libc.mallinfo2().e

libc = ctypes.CDLL(None)
libc.mallinfo2.restype = Said
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
libc.free.argtypes = [ctypes.c_void_p]
if sys.argv[1] == "steady":
    heap.give_back_what_is_big()
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
