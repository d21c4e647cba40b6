"""Makes what stops the robot: words, a key, and the program that is run at a stop."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING, TypeAlias

from nondum.host.assembly.base import Base
from nondum.host.mind.mind import Mind
from nondum.host.people.conversation import Take, wanted
from nondum.host.people.stop_button.button import StopButton
from nondum.host.people.stop_button.hook import StopHook
from nondum.host.people.stopping import Stopped, Stopping, is_stop_for_stranger, said_to
from nondum.host.workers.workers import Workers
from nondum.planning.words.stop_words import is_stop
from nondum.sdk.frozen import frozen

if TYPE_CHECKING:
    from nondum.host.peers.peer_services import PeerServices

StopAll: TypeAlias = Callable[[], Awaitable[Stopped]]
"""Stops this host, and the peers that go by what is said here."""


@frozen
class StopParts:
    """What stops this host, and what it runs then."""

    stopping: Stopping
    hook: StopHook


def make_stopping(base: Base, workers: Workers, mind: Callable[[], Mind]) -> StopParts:
    """Make what stops this host; `mind` is asked for once the host runs."""
    hook = StopHook(base.config.stop)
    return StopParts(Stopping(mind, workers, hook.run_soon), hook)


def stop_all(peers: PeerServices | None, stopping: Stopping) -> StopAll:
    """What stops this host, and the peers where there are any."""
    if peers is not None:
        return peers.goals.stop_all

    async def alone() -> Stopped:
        return stopping.stop()

    return alone


def make_stop_button(base: Base, mind: Mind, stop_all: StopAll) -> StopButton:
    """Make what waits for the stop key."""

    async def pressed() -> None:
        mind.people.tell(f"the stop key: {await stop_all()}")

    return StopButton(base.config.stop, pressed)


def take(peers: PeerServices | None, mind: Mind, stopping: Stopping) -> Take:
    """What becomes of words that are heard."""
    if peers is not None:
        return peers.goals.take

    async def taken(words: str) -> str:
        _, said = said_to(words, [mind.beliefs.snapshot.host], mind)
        is_for_all = is_stop(said) or is_stop_for_stranger(said, mind)
        return str(stopping.stop()) if is_for_all else wanted(mind, said)

    return taken
