"""How this process has memory from the C library, for lives of months.

What is big is mapped and given back whole. glibc by itself begins to take it from the heap as soon
as one big block was freed (mallopt(3), M_MMAP_THRESHOLD): there, small things settle in the place
that a big one leaves, the next big one does not fit any more, and the heap grows by one each time.
Two megabytes for each few hundred drives were measured.
"""

from __future__ import annotations

import ctypes
import gc

BIG_BYTES = 128 * 1024
"""glibc's own, before it changes it."""

_M_MMAP_THRESHOLD = -3


def give_back_what_is_big() -> None:
    """From now on. A C library without mallopt(3) is left as it is."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, BIG_BYTES)


def keep_what_is_loaded() -> None:
    """Have the garbage collector pass over all that is there now: modules, which stay to the end.

    A full collection looks through it on the loop, whenever what has come since is a quarter of it:
    10 ms for 64,000 objects, measured on a fast machine.
    """
    gc.collect()
    gc.freeze()
