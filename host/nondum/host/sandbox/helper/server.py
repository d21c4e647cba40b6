"""Listens for the daemon: one user, small packets, a child for each connection, and an early end.

The socket comes from systemd (sd_listen_fds(3)), which starts the helper when somebody connects.
What a drive makes hang, hangs one child; the others go on.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import struct
import sys
from collections.abc import Callable
from contextlib import closing

from nondum.host.rpc import outcomes
from nondum.host.sandbox.helper import removals, requests
from nondum.host.sandbox.helper.requests import CALL, HEARD, LISTENING, PRESSED, refused
from nondum.host.sandbox.helper.service import Service
from nondum.host.sandbox.helper.stop_key import PressesOfDevice
from nondum.sdk.errors import InstallFailed, NondumError, Problem
from nondum.sdk.wire import Body, Event, Reply, WireMessage, encode

IDLE_S = 30.0
"""Without a question for so long, the helper ends; systemd keeps listening."""
QUESTION_S = 5.0
"""From a connection to its question."""
DRIVE_S = 12.0
"""After that a child that hangs in its drive is killed, as far as it can be."""
MOST_CHILDREN = 32
_CREDENTIALS = struct.Struct("3i")


class Server:
    """Serves connections until it is told to end, or no more connections come."""

    def __init__(
        self,
        listening: socket.socket,
        service: Service,
        ending: int,
        uevents: socket.socket,
        idle_s: float = IDLE_S,
    ) -> None:
        """`ending` is a descriptor that can be read once the server is to end; `uevents` gets the
        kernel's messages (see `removals.listen`)."""
        self._listening, self._service, self._idle_s = listening, service, idle_s
        self._ending, self._uevents = ending, uevents
        self._children: set[int] = set()

    def run(self) -> None:
        """Serve; returns when it is to end, or after `idle_s` without a connection, with no child
        left and no node, which would have to be removed with its device."""
        self._listening.settimeout(0)
        self._uevents.settimeout(0)
        self._service.nodes.drop_unfit()  # what was removed while no helper ran
        listening, told = self._listening.fileno(), self._uevents.fileno()
        sources = [self._ending, listening, told]
        while True:
            ready, _, _ = select.select(sources, [], [], self._idle_s)
            self._reap()
            if self._ending in ready:
                return
            if told in ready:
                self._see_removal()
            if listening in ready:
                self._accept()
            elif not ready and not self._children and not self._service.nodes.are_there:
                return

    def _see_removal(self) -> None:
        try:
            number = removals.removed(self._uevents.recv(removals.UEVENT_BYTES))
        except BlockingIOError:
            return
        except OSError:  # ENOBUFS: more came than the kernel keeps
            self._service.nodes.drop_unfit()
            return
        if number is not None:
            self._service.nodes.drop(*number)

    def _accept(self) -> None:
        try:
            connection, _ = self._listening.accept()
        except OSError:  # it has gone again
            return
        with connection:
            if _peer(connection) != self._service.uid:
                _say(connection, _answer(refused("this user is not served")))
            elif len(self._children) >= MOST_CHILDREN:
                _say(connection, _answer(_busy()))
            else:
                self._start(connection)

    def _start(self, connection: socket.socket) -> None:
        """Have a child answer. This process goes on without one: its end would leave the nodes of
        devices that are pulled meanwhile."""
        try:
            self._children.add(_child(lambda: self._answer(connection)))
        except OSError:
            _say(connection, _answer(_busy()))

    def _answer(self, connection: socket.socket) -> None:
        self._listening.close()
        connection.settimeout(QUESTION_S)
        _tell(connection, HEARD, {})
        _say(connection, answer(connection, self._service))

    def _reap(self) -> None:
        while self._children:
            pid, _ = os.waitpid(-1, os.WNOHANG)
            if pid == 0:
                return
            self._children.discard(pid)


def answer(connection: socket.socket, service: Service) -> Reply:
    """Take one question and do what it asks; the answer, or what is wrong."""
    brought: list[int] = []
    try:
        # The buffer takes one descriptor: the kernel closes all others.
        data, brought, flags, _ = socket.recv_fds(connection, requests.MAX_BYTES + 1, 1)
        if flags & (socket.MSG_TRUNC | socket.MSG_CTRUNC):
            raise refused("a question is one short packet")
        request = requests.parse(data)
        if len(brought) != isinstance(request, requests.MapFolder):
            raise refused(f"{type(request).__name__} came with {len(brought)} descriptors")
        if isinstance(request, requests.ListenToStopKey):
            return _listen(connection, service)
        return Reply(CALL, outcomes.packed(service.serve(request, *brought)))
    except NondumError as error:
        return _answer(error)
    except OSError as error:
        text = f"{error.strerror or error} ({error.filename})" if error.filename else str(error)
        return _answer(InstallFailed(Problem("HELPER_FAILED", text, fix=_LOOK)))
    finally:
        for descriptor in brought:
            os.close(descriptor)


def _listen(connection: socket.socket, service: Service) -> Reply:
    """Tell presses of the stop key until the other end hangs up, or its device is gone."""
    signal.alarm(0)  # that may be long
    with closing(service.stop_key()) as presses:
        _tell(connection, LISTENING, {"down": presses.is_down_at_first})
        while True:
            sources: list[socket.socket | PressesOfDevice] = [connection, presses]
            ready, _, _ = select.select(sources, [], [])
            if connection in ready:
                return Reply(CALL, outcomes.packed({}))
            if pressed := presses.read():
                _tell(connection, PRESSED, {"times": pressed})


def _child(work: Callable[[], None]) -> int:
    pid = os.fork()
    if pid:
        return pid
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.alarm(int(DRIVE_S))
        work()
    except Exception as error:
        sys.stderr.write(f"{error!r}\n")
    finally:
        os._exit(0)


def _peer(connection: socket.socket) -> int:
    """The user at the other end, as it was when it connected (SO_PEERCRED, unix(7))."""
    told = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    uid: int = _CREDENTIALS.unpack(told)[1]
    return uid


def _tell(connection: socket.socket, event: str, body: Body) -> None:
    _say(connection, Event(event, CALL, body))


def _say(connection: socket.socket, message: WireMessage) -> None:
    try:
        connection.send(encode(message), socket.MSG_DONTWAIT)
    except OSError:  # the client does not wait for it
        return


def _answer(error: NondumError) -> Reply:
    return Reply(CALL, outcomes.refused(error))


def _busy() -> InstallFailed:
    text = "the helper does as many things at once as it may"
    return InstallFailed(Problem("HELPER_BUSY", text, fix=_LOOK))


_LOOK = "`journalctl -u nondum-helper` says more"
