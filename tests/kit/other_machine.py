"""A program that is told by the kernel that it is on a 32-bit machine, as by setarch(8): wheels for
this one do not fit it.

`python -m tests.kit.other_machine MODULE ARGUMENT…`, which the fork server can fork.
"""

from __future__ import annotations

import ctypes
import platform
import runpy
import sys

_PER_LINUX32 = 0x0008
"""See personality(2)."""


def main() -> None:
    """Be the program that is named."""
    if ctypes.CDLL(None).personality(_PER_LINUX32) < 0:
        raise SystemExit("this kernel knows no other machine")
    platform._uname_cache = None  # type: ignore[attr-defined]  # of before
    del sys.argv[0]
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
