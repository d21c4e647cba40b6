"""A worker process's first steps: load the standard library, wait for orders, bind itself to its
limits and its host, then run the SDK.

Run by path as `python -I -S -B -u bootstrap.py ORDERS HOST`: the descriptor of a socket on which
one JSON object comes, with the link's descriptor (see `launcher.py`), and the host's process id.
No start-up hook of any wheel has run, and none will, since site-packages are appended to
`sys.path` and not added with `site.addsitedir`.
"""

import ctypes
import fcntl
import importlib
import json
import os
import resource
import signal
import socket
import sys

PRELOADED = (
    *("__future__", "ast", "asyncio", "contextvars", "dataclasses", "importlib.metadata"),
    *("inspect", "logging", "math", "mmap", "pathlib", "random", "traceback", "typing"),
    "warnings",
)
"""What the SDK and pluggy import of the standard library, with what those import in turn."""
PR_SET_PDEATHSIG = 1
PR_SET_NAME = 15
PR_SET_NO_NEW_PRIVS = 38
"""From linux/prctl.h."""
MEGABYTE = 1024 * 1024
ORDER_BYTES = 128 * 1024


def main(orders: int, host_pid: int) -> None:
    """Be a spare interpreter, then a worker; does not return."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != host_pid:  # it died before this process could ask to be told
        raise SystemExit("the host is gone")
    for name in PRELOADED:
        importlib.import_module(name)
    with socket.socket(fileno=orders) as waiting:
        order, descriptors, _, _ = socket.recv_fds(waiting, ORDER_BYTES, 1)
    if not order:
        raise SystemExit(0)  # not needed
    become(libc, json.loads(order), descriptors[0])


def become(libc: ctypes.CDLL, parameters: dict, link: int) -> None:  # type: ignore[type-arg]
    """Become a worker."""
    settle(parameters)
    limit(parameters["limits"])
    confine(libc)
    die_with(libc, parameters["host_pid"])
    libc.prctl(PR_SET_NAME, parameters["component"][:15].encode(), 0, 0, 0)
    # What the plugin starts must not keep the link open once the plugin is gone.
    fcntl.fcntl(link, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    sys.path.extend(parameters["site_packages"])
    sys.argv = [parameters["component"]]
    from nondum.sdk import worker

    worker.main(link, parameters["entry_point"], parameters["distribution"])


def settle(parameters: dict) -> None:  # type: ignore[type-arg]
    """Move to the scratch folder, and take on the worker's environment.

    What a process starts inherits that, but what others see of the process itself is the memory
    that it was started with (proc_pid_environ(5)), so the mark is written there as well.
    """
    place = address_of(os.fsencode(parameters["room"]) + b"=")
    size = len(ctypes.string_at(place))
    os.environ.clear()
    os.environ.update(parameters["environment"])
    ctypes.memmove(place, os.fsencode(parameters["mark"]).ljust(size, b"\0"), size)
    os.chdir(parameters["scratch"])


def address_of(start: bytes) -> int:
    """Where the environment variable that starts so lies in memory."""
    strings = ctypes.POINTER(ctypes.c_void_p).in_dll(ctypes.CDLL(None), "environ")
    index = 0
    while not ctypes.string_at(strings[index]).startswith(start):
        index += 1
    place: int = strings[index]
    return place


def limit(limits: dict) -> None:  # type: ignore[type-arg]
    """Set hard resource limits (setrlimit(2)); what the system limits more stays so."""
    wanted = {
        # Not RLIMIT_AS: numeric and graphics libraries reserve far more than they use.
        resource.RLIMIT_DATA: limits["memory_mb"] * MEGABYTE,
        resource.RLIMIT_NOFILE: limits["descriptors"],
        resource.RLIMIT_FSIZE: limits["file_mb"] * MEGABYTE,
        resource.RLIMIT_CORE: 0,
    }
    if limits["cpu_s"] is not None:
        wanted[resource.RLIMIT_CPU] = limits["cpu_s"]
    if os.getuid() != 0:  # counts all tasks of the user, and root is not bound by it
        wanted[resource.RLIMIT_NPROC] = tasks_of(os.getuid()) + limits["tasks"]
    for kind, value in wanted.items():
        _, hard = resource.getrlimit(kind)
        if hard != resource.RLIM_INFINITY:
            value = min(value, hard)
        resource.setrlimit(kind, (value, value))


def tasks_of(uid: int) -> int:
    """How many processes and threads a user has now."""
    count = 0
    with os.scandir("/proc") as entries:
        for entry in entries:
            try:
                if entry.name.isdigit() and entry.stat().st_uid == uid:
                    count += os.stat(f"{entry.path}/task").st_nlink - 2  # noqa: PTH116  # pathlib: 3 ms
            except OSError:  # it has just ended
                continue
    return count


def confine(libc: ctypes.CDLL) -> None:
    """Give up for good what set-user-id programs could grant."""
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "PR_SET_NO_NEW_PRIVS")


def die_with(libc: ctypes.CDLL, host_pid: int) -> None:
    """End two seconds after the host does, however stuck the interpreter is.

    The kernel tells of the host's death by SIGINT, signal number 2, and its handler is the C
    library's own `alarm`: called as `alarm(2)`, without the interpreter, it has SIGALRM end the
    process in two seconds. Until then the plugin, which sees its link closed, may leave everything
    safe. (Terminals do not reach workers: they are sessions of their own.)
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # so that asyncio leaves it alone
    libc.signal.restype = ctypes.c_void_p
    libc.signal(ctypes.c_int(signal.SIGINT), ctypes.cast(libc.alarm, ctypes.c_void_p))
    libc.prctl(PR_SET_PDEATHSIG, signal.SIGINT, 0, 0, 0)
    if os.getppid() != host_pid:  # it died before this process could ask to be told
        raise SystemExit("the host is gone")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
