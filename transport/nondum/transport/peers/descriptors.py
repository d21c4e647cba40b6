"""Whether this process may open the descriptors that ZeroMQ takes before it listens or dials.

libzmq 4.3.5 aborts the process where it gets none for the threads of a context (its epoll.cpp), or
to look up the interfaces of this machine (its ip_resolver.cpp). So it is asked for before.
"""

from __future__ import annotations

import contextlib
import errno
import os

import zmq

FIRST_SOCKETS = 16
"""More than a new context takes with all sockets until it listens, its threads' included."""


def see_that_there_are(count: int = FIRST_SOCKETS) -> None:
    """Take `count` descriptors, and give them back. Raises `OSError` where there are fewer."""
    with contextlib.ExitStack() as taken:
        for _ in range(count):
            taken.callback(os.close, os.eventfd(0))


def remedy(error: OSError | zmq.ZMQError) -> str:
    """What a person can do where descriptors were wanting; empty where something else was."""
    if error.errno == errno.EMFILE:
        return "raise the limit of open files of this process: LimitNOFILE= (systemd.exec(5))"
    if error.errno == errno.ENFILE:
        return "end programs that have many files open on this machine"
    return ""
