"""A worker process's first steps: load the standard library, wait for orders, bind itself to its
limits and its host, then run the SDK.

Run by path as `python -I -S -B -u bootstrap.py ORDERS HOST`: the descriptor of a socket on which
one JSON object comes, with the link's descriptor (see `workers/launcher.py`), and the host's
process id; 0 where it has none, in a separate process namespace. No start-up hook of any wheel
has run, and none will, since site-packages are appended to `sys.path` and not added with
`site.addsitedir`.
"""

import ctypes
import fcntl
import importlib
import json
import os
import signal
import socket
import sys
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Any

PRELOADED = (
    *("__future__", "ast", "asyncio", "contextvars", "dataclasses", "faulthandler"),
    *("importlib.metadata", "inspect", "logging", "math", "mmap", "numbers", "pathlib", "random"),
    *("resource", "traceback", "typing", "warnings"),
)
"""What the SDK and pluggy import of the standard library, with what those import in turn."""
INSIDE = ("init", "inspect_self", "kernel", "limits", "mounts", "open_files", "restrict")
ORDER_BYTES = 128 * 1024
DESCRIPTORS = 2
"""The link, and Landlock's ruleset."""


def main(orders: int, host_pid: int) -> None:
    """Be a spare interpreter, then a worker; does not return."""
    inside = _own_modules()
    if host_pid:
        inside["kernel"].end_with(host_pid)
    for name in PRELOADED:
        importlib.import_module(name)
    waiting = socket.socket(fileno=orders)
    order, descriptors, _, _ = socket.recv_fds(waiting, ORDER_BYTES, DESCRIPTORS)
    if not order:
        raise SystemExit(0)  # not needed
    parameters = json.loads(order)
    settle(parameters)
    if parameters["mounts"] is not None:
        inside["init"].fork_worker(waiting, parameters["mounts"], descriptors)
    else:
        waiting.close()
    become(inside, parameters, descriptors, host_pid)


def become(
    inside: Mapping[str, ModuleType],
    parameters: Mapping[str, Any],
    descriptors: Sequence[int],
    host_pid: int,
) -> None:
    """Become a worker."""
    link, *rulesets = descriptors
    kernel = inside["kernel"]
    os.chdir(parameters["scratch"])
    inside["limits"].limit(parameters["limits"])
    inside["restrict"].restrict(parameters["restrictions"], next(iter(rulesets), None))
    if host_pid:
        die_with(kernel, host_pid)
    kernel.prctl(kernel.PR_SET_NAME, kernel.text(parameters["component"][:15]))
    # What the plugin starts must not keep the link open once the plugin is gone.
    fcntl.fcntl(link, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    if parameters["looks"]:
        inside["inspect_self"].main(link)
    sys.path.extend(parameters["site_packages"])
    sys.argv = [parameters["component"]]
    from nondum.sdk import worker

    worker.main(link, parameters["entry_point"], parameters["distribution"])


def settle(parameters: Mapping[str, Any]) -> None:
    """Take on the worker's environment.

    What a process starts inherits that, but what others see of the process itself is the memory
    that it was started with (proc_pid_environ(5)), so the mark is written there as well.
    """
    place = address_of(os.fsencode(parameters["mark_placeholder"]) + b"=")
    size = len(ctypes.string_at(place))
    os.environ.clear()
    os.environ.update(parameters["environment"])
    ctypes.memmove(place, os.fsencode(parameters["mark"]).ljust(size, b"\0"), size)


def address_of(start: bytes) -> int:
    """Where the environment variable that starts so lies in memory."""
    strings = ctypes.POINTER(ctypes.c_void_p).in_dll(ctypes.CDLL(None), "environ")
    index = 0
    while not ctypes.string_at(strings[index]).startswith(start):
        index += 1
    place: int = strings[index]
    return place


def die_with(kernel: ModuleType, host_pid: int) -> None:
    """End two seconds after the host does, however stuck the interpreter is.

    The kernel tells of the host's death by SIGINT, signal number 2, and its handler is the C
    library's own `alarm`: called as `alarm(2)`, without the interpreter, it has SIGALRM end the
    process in two seconds. Until then the plugin, which sees its link closed, may leave everything
    safe. (Terminals do not reach workers: each worker is a separate session, setsid(2).)
    """
    libc = kernel.LIBC
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # so that asyncio leaves it alone
    libc.signal.restype = ctypes.c_void_p
    libc.signal(ctypes.c_int(signal.SIGINT), ctypes.cast(libc.alarm, ctypes.c_void_p))
    kernel.end_with(host_pid, signal.SIGINT)


def _own_modules() -> dict[str, ModuleType]:
    """The other modules of this folder; the host's own packages are not left to be found."""
    root = os.path.dirname(os.path.abspath(__file__))  # noqa: PTH100, PTH120  # pathlib: 3 ms
    for _ in ["nondum", "host", "sandbox", "inside"]:
        root = os.path.dirname(root)  # noqa: PTH120
    sys.path.append(root)
    found = {name: importlib.import_module(f"nondum.host.sandbox.inside.{name}") for name in INSIDE}
    sys.path.remove(root)
    for name in [name for name in sys.modules if name.partition(".")[0] == "nondum"]:
        del sys.modules[name]
    return found


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
