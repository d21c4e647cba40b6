"""Process 1 of a sandbox: reaps what the worker leaves behind, mounts devices, and ends the whole
namespace once the worker or the host has ended.

The worker, in a separate user namespace, can neither look into it nor signal it.
"""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import os
import select
import signal
import socket
import time
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import Any

from nondum.host.sandbox.inside import kernel, mounts, open_files

GRACE_S = 2.0
"""What a worker has to leave everything safe once the host has ended."""
ORDER_BYTES = 4096
MOST_DELETED = 50_000
"""Of files that are open and deleted, this many are looked at."""
HOST_GONE = 1
"""Exit status, when the host was gone before the worker."""


def fork_worker(orders: socket.socket, given: Mapping[str, Any], links: Sequence[int]) -> None:
    """Set up the mounts and fork; returns in the worker only. Raises `OSError`."""
    # The host's end is seen at the socket from now on: the plugin may have two seconds.
    kernel.prctl(kernel.PR_SET_PDEATHSIG, 0)
    _close_all_but({0, 1, 2, orders.fileno(), *links})
    mask = os.umask(0o022)  # what is made here is for the worker, who may be another user
    mounts.set_up(given, partial(_have_mapped, orders))
    _say_who(orders, "init")
    worker = os.fork()
    if worker == 0:
        os.umask(mask)
        os.setsid()
        _say_who(orders, "worker")
        orders.close()
        mounts.pivot(given)
        return
    for link in links:
        os.close(link)
    os._exit(_Init(orders, given, worker).run())


def _close_all_but(needed: Collection[int]) -> None:
    """Bubblewrap leaves open what it has told of itself by (`--info-fd`)."""
    for name in os.listdir("/proc/self/fd"):  # noqa: PTH208
        if int(name) not in needed:
            with contextlib.suppress(OSError):  # that of the list itself
                os.close(int(name))


def _have_mapped(orders: socket.socket, mount: int) -> None:
    """Have the host map the users of a mount; where it cannot, it ends this process."""
    socket.send_fds(orders, [b"mount"], [mount])
    orders.recv(ORDER_BYTES)


def _say_who(orders: socket.socket, who: str) -> None:
    """The kernel adds the process's id, as the host counts."""
    orders.send(json.dumps({"is": who}).encode())


class _Init:
    def __init__(self, orders: socket.socket, given: Mapping[str, Any], worker: int) -> None:
        self._orders, self._given, self._worker = orders, given, worker
        self._poll = select.poll()

    def run(self) -> int:
        """Reap and obey until the worker has ended; its exit status, 128 and more for a signal."""
        awoken = self._settle()
        self._poll.register(awoken, select.POLLIN)
        self._poll.register(self._orders, select.POLLIN)
        deadline_s: float | None = None
        while (status := self._reaped()) is None:
            left_s = None if deadline_s is None else deadline_s - time.monotonic()
            if left_s is not None and left_s <= 0:
                return HOST_GONE
            for ready, _ in self._poll.poll(None if left_s is None else left_s * 1000):
                if ready == awoken:
                    with contextlib.suppress(BlockingIOError):
                        os.read(awoken, 512)
                elif not self._obeyed():
                    self._poll.unregister(self._orders)
                    deadline_s = time.monotonic() + GRACE_S
        return (
            os.waitstatus_to_exitcode(status) % 256
            if os.WIFEXITED(status)
            else (128 + os.WTERMSIG(status))
        )

    def _settle(self) -> int:
        """Give up all but the mounts; returns what becomes readable when a child ends."""
        awoken, alarm = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.set_wakeup_fd(alarm, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        nothing = os.open(os.devnull, os.O_RDWR)
        for standard in (1, 2):  # the worker's alone: the host waits for their end
            os.dup2(nothing, standard)
        kernel.prctl(kernel.PR_SET_NAME, kernel.text("nondum-init"))
        # Where the host may not look into its processes, this one does.
        looks = (kernel.CAP_DAC_READ_SEARCH, kernel.CAP_SYS_PTRACE)
        kernel.keep_capabilities(
            kernel.CAP_SYS_ADMIN, *(looks if self._given["maps_scratch"] else ())
        )
        if self._given["init_filter"] is not None:
            kernel.filter_calls(base64.b64decode(self._given["init_filter"]))
        return awoken

    def _reaped(self) -> int | None:
        """Reap all that has ended; the worker's status once it has."""
        with contextlib.suppress(ChildProcessError):
            while True:
                pid, status = os.waitpid(-1, os.WNOHANG)
                if pid == self._worker:
                    return status
                if pid == 0:
                    return None
        return None

    def _obeyed(self) -> bool:
        """Carry out one order; False once the host's end is closed."""
        try:
            data = self._orders.recv(ORDER_BYTES)
        except OSError:
            return False
        if not data:
            return False
        order = json.loads(data)
        answer: dict[str, Any] = {"is": "done", "error": ""}
        try:
            match order["do"]:
                case "grant":
                    mounts.grant(self._given["outside"], order["need"], order["node"], order["own"])
                case "revoke":
                    mounts.revoke(order["need"])
                case _:
                    answer |= self._seen()
        except OSError as failure:
            answer["error"] = str(failure)
        with contextlib.suppress(OSError):
            self._orders.send(json.dumps(answer).encode())
        return True

    def _seen(self) -> dict[str, int]:
        """What the processes of the sandbox have open."""
        pids = [int(name) for name in os.listdir("/proc") if name.isdigit() and name != "1"]  # noqa: PTH208
        deleted = itertools.islice(
            open_files.deleted_sizes(self._given["scratch"], pids), MOST_DELETED
        )
        return {"descriptors": open_files.most(pids), "deleted_bytes": sum(deleted)}
