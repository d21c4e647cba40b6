"""A daemon whose stop key is a pipe: `python -m benchmarks.stop.with_key PIPE COMMAND…`.

Only the opening of the device is another: what is read are the kernel's own `struct input_event`s,
by the reader that a host reads its key with. COMMAND is how a host is started otherwise.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from nondum.cli import main as nondum
from nondum.host.sandbox.helper.client import HelperClient
from nondum.host.sandbox.helper.privileged import InProcess
from nondum.host.sandbox.helper.stop_key import PressesOfDevice

MODULE = "nondum.cli"


def main() -> None:
    """Run what comes after the module's name."""
    pipe, command = Path(sys.argv[1]), sys.argv[2:]

    def opened(_: object, device: Path, code: int) -> PressesOfDevice:
        return PressesOfDevice(os.open(pipe, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC), code)

    for kind in (InProcess, HelperClient):
        kind.stop_key = opened  # type: ignore[method-assign, assignment]  # that is the point
    nondum(command[command.index(MODULE) + 1 :])


if __name__ == "__main__":
    main()
