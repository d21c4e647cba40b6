"""A worker that sends descriptors which nothing reads, beside two between which frames flow."""

from __future__ import annotations

from tests.host.workers.streaming import CAMERA, STREAM, WATCH, WATCHER
from tests.kit.guest import do, guest_spec
from tests.kit.workers import HOST, WorkersUnderTest, camera

from nondum.host.core.events.workers import WorkerLogged
from nondum.host.workers.spec import Limits
from nondum.sdk.description import Unit

FILLS = """
kept = []

def fill(one, count):
    # Until it is refused.
    try:
        for _ in range(2000):
            socket.send_fds(one, [b"x"], [0] * count)
    except OSError as error:
        print("filled", error.errno, flush=True)

def openly():
    pair = socket.socketpair()
    kept.append(pair)
    fill(pair[0], 20)

def in_sockets_that_are_under_way():
    outer = socket.socketpair()
    kept.append(outer)
    for count in (20, 5):  # so that few are left to be seen
        while hidden(outer[0], count):
            pass
    fill(outer[0], 1)

def hidden(outer, count):
    one, other = socket.socketpair()
    try:
        socket.send_fds(one, [b"x"], [0] * count)
        socket.send_fds(outer, [b"x"], [other.fileno()])
    except OSError:
        return False
    kept.append(one)
    return True

def by_a_child():
    if os.fork() == 0:
        openly()
        time.sleep(600)
"""
FEW_FILES, MORE_FILES = Limits(descriptors=200), Limits(descriptors=400)
"""The kernel counts by user: other programs of this one, with usual limits, are not to notice, and
what they have under way for a moment is not to matter."""


async def fills_and_streams(tested: WorkersUnderTest, way: str) -> None:
    """One worker sends descriptors until it may not; then another one begins to send frames."""
    body = f"{way}()\nawait ctx.sleep(600)"
    await tested.workers.start(guest_spec(tested, body, FILLS, name="hostile", limits=MORE_FILES))
    cameras = (camera(),)
    await tested.start("cam", CAMERA, behaviours=(STREAM,), units=cameras, limits=FEW_FILES)
    eye = (Unit("eye", "detector"),)
    await tested.start("watcher", WATCHER, behaviours=(WATCH,), units=eye)
    do(tested, "hostile")
    await tested.until(WorkerLogged, lambda event: event.message == "filled 109")
    frames = f"{HOST}__cam__frames"
    tested.behave("cam", "stream", u=f"{HOST}__cam__camera", o=frames)
    tested.behave("watcher", "watch", u=f"{HOST}__watcher__eye", i=frames)
