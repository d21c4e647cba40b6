"""Programs on a machine of a network (`demo.namespaces`), forked like all others.

`python -m tests.kit.on_machine NAMESPACE MODULE ARGUMENT…` does what `ip netns exec NAMESPACE
python -m MODULE …` would, but for /sys, which shows the interfaces of the namespace there.
"""

from __future__ import annotations

import ctypes
import os
import runpy
import sys
from pathlib import Path
from typing import Any

from demo.namespaces import Machine
from tests.kit.fork_server import Forked, fork_server

NAMESPACES = Path("/run/netns")
_CLONE_NEWNET = 0x40000000


def started(machine: Machine, module: str, *arguments: str, **streams: Any) -> Forked:
    """Start a module there; it is killed with the network. See `ForkServer.start`."""
    process = fork_server().start(on(machine, module, *arguments)[2:], **streams)
    machine.processes.append(process)
    return process


def on(machine: Machine, module: str, *arguments: str) -> tuple[str, ...]:
    """The command that runs a module there."""
    return (sys.executable, "-m", __name__, machine.namespace, module, *arguments)


def main() -> None:
    """Be the program that is named, in a network namespace (setns(2))."""
    del sys.argv[0]
    namespace = os.open(NAMESPACES / sys.argv.pop(0), os.O_RDONLY)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(namespace, _CLONE_NEWNET):
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    os.close(namespace)
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
