"""A process that forks others: they have what it has imported, and none has what another one read.

To start an interpreter and import what a job needs takes a hundred times as long as a fork, on a
small computer seconds. The daemon cannot fork itself, since it has threads and an event loop. This
process has one thread, reads nothing but requests, and is forked before it does anything else.
(multiprocessing has such a `forkserver`, too; it needs a socket in a folder, a second process that
tracks resources, and imports the main program again in each process.)
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import select
import signal
import socket
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from nondum.sdk.frozen import frozen

REQUEST_BYTES = 1 << 20
MOST_DESCRIPTORS = 4
ANSWER_BYTES = 16
IDLE_S = 0.1
"""Without a request for so long, the server takes a step ahead."""


def ask(channel: socket.socket, message: bytes, descriptors: Sequence[int]) -> None:
    """Ask for a process; `answer` tells of it.

    It has these descriptors as its 0, 1 … in place of the server's, and no others but the server's
    standard ones. The last one is not for it: to this pipe the server writes the return code once
    the process has ended, in decimal, negative for a signal. Without descriptors, no process is
    wanted yet, and nothing is answered: the server prepares for one when it has time.
    """
    socket.send_fds(channel, [message], list(descriptors))


def answer(channel: socket.socket) -> tuple[int, int]:
    """The new process's pid and pidfd.

    Raises `EOFError` when the server has ended, `OSError` when it could not fork, or this process
    has no descriptor left for the pidfd: that process ends by the end of its conversation.
    """
    said, descriptors, _, _ = socket.recv_fds(channel, ANSWER_BYTES, 1)
    if not said:
        raise EOFError("the fork server has ended")
    if (number := int(said)) < 0:
        raise OSError(-number, os.strerror(-number))
    if not descriptors:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
    (descriptor,) = descriptors
    fcntl.fcntl(descriptor, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
    return number, descriptor


def serve(
    channel: socket.socket,
    *,
    prepare: Callable[[bytes], None] = lambda message: None,
    ahead: Iterable[None] = (),
) -> bytes | None:
    """Answer requests. Returns in each new process, with the message of its request; and None in
    this one when the client has closed its end: then all others are killed.

    `prepare` is called with a message before the fork. A step of `ahead` is taken whenever nothing
    was to be done for a while.
    """
    children = _Children(channel)
    wanted: list[bytes] = []
    steps, is_ready = iter(ahead), False
    while True:
        found = children.events(None if is_ready and not wanted else IDLE_S)
        if not found and wanted:
            prepare(wanted.pop(0))
        elif not found:
            is_ready = next(steps, _NO_STEP) is _NO_STEP
        for descriptor in found:
            if descriptor != channel.fileno():
                children.see_end(descriptor)
                continue
            request = _received(channel)
            if request is None:
                children.kill()
                return None
            if not request.descriptors:
                wanted.append(request.message)
                continue
            prepare(request.message)
            if children.fork(request.descriptors) == 0:
                return request.message


_NO_STEP = object()


@frozen
class _Request:
    message: bytes
    descriptors: Sequence[int]


def _received(channel: socket.socket) -> _Request | None:
    """A request; None when the client has ended."""
    try:
        message, found, _, _ = socket.recv_fds(channel, REQUEST_BYTES, MOST_DESCRIPTORS)
    except ConnectionError:
        return None
    return _Request(message, found) if message else None


@frozen
class _Child:
    pid: int
    status: int
    """Where its return code is to be written."""


class _Children:
    """The processes that were forked and run."""

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._running: dict[int, _Child] = {}
        """By their pidfds."""
        self._poll = select.poll()
        self._poll.register(channel, select.POLLIN)

    def events(self, patience_s: float | None) -> list[int]:
        """The pidfds of those that have ended, and the channel if there is something to be read."""
        return [found for found, _ in self._poll.poll(patience_s and patience_s * 1000)]

    def fork(self, descriptors: Sequence[int]) -> int:
        """Fork; its pid, or 0 in the new process. A failure is answered, and -1."""
        assert len(list(Path("/proc/self/task").iterdir())) == 1, "a fork has one thread"
        *others, status = descriptors
        try:
            pid = os.fork()
        except OSError as error:
            self._answer(f"-{error.errno}", ())
            for descriptor in descriptors:
                os.close(descriptor)
            return -1
        if pid == 0:
            self._channel.detach()
            _keep_only(others)
            return 0
        for descriptor in others:
            os.close(descriptor)
        child = os.pidfd_open(pid)
        self._running[child] = _Child(pid, status)
        self._poll.register(child, select.POLLIN)
        try:
            self._answer(str(pid), (child,))
        except OSError as error:
            if error.errno != errno.ETOOMANYREFS:  # too many of this user's are under way (unix(7))
                raise
            signal.pidfd_send_signal(child, signal.SIGKILL)  # it was never handed over
            self._answer(f"-{error.errno}", ())
        return pid

    def see_end(self, descriptor: int) -> None:
        """Tell the return code of one that has ended."""
        self._poll.unregister(descriptor)
        child = self._running.pop(descriptor)
        _, status = os.waitpid(child.pid, 0)
        with contextlib.suppress(BrokenPipeError):  # no process reads it any more
            os.write(child.status, str(os.waitstatus_to_exitcode(status)).encode())
        os.close(child.status)
        os.close(descriptor)

    def kill(self) -> None:
        """Kill all. They are not waited for: a disk may hold one for ever."""
        for descriptor in self._running:
            with contextlib.suppress(ProcessLookupError):
                signal.pidfd_send_signal(descriptor, signal.SIGKILL)

    def _answer(self, text: str, descriptors: Sequence[int]) -> None:
        with contextlib.suppress(ConnectionError):  # the client has ended: that is read next
            socket.send_fds(self._channel, [text.encode()], list(descriptors))


def _keep_only(descriptors: Sequence[int]) -> None:
    """Have these as 0, 1 … and no others but the standard ones."""
    for number, descriptor in enumerate(descriptors):
        os.dup2(descriptor, number)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))
