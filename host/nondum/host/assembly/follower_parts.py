"""Makes what follows events, and subscribes it in the order in which it is told of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from nondum.host.assembly.base import Base
from nondum.host.assembly.mind_listener import MindListener
from nondum.host.control.news import News
from nondum.host.manager.effect_handlers import Executor
from nondum.host.manager.refusal_retry import RefusalRetry
from nondum.host.mind.mind import Mind
from nondum.host.sources.devices.software import Software
from nondum.host.trust.clock import ClockWatch
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen

if TYPE_CHECKING:
    from nondum.host.peers.peer_services import PeerServices


@frozen
class FollowerParts:
    """What follows events, or looks for something to tell as one."""

    news: News
    software: Software
    clock: ClockWatch
    refusal_retry: RefusalRetry


def make_followers(
    base: Base,
    workers: Workers,
    executor: Executor,
    mind: Mind,
    peers: PeerServices | None,
    places: Callable[[], Mapping[str, str]],
) -> FollowerParts:
    """Make them, and subscribe them. Refused payloads are tried again, but for those that have
    `places` on peers."""
    bus, snapshot, amounts = base.bus, base.catalogue.snapshot, executor.installation.amounts
    news, software = News(), Software(snapshot, mind.people.tell)
    clock = ClockWatch(lambda: executor.trust.trust, bus.emit)
    bus.subscribe(MindListener(base.catalogue, mind, workers).on_event)
    if peers is not None:
        bus.subscribe(peers.on_event)
    for follower in (news, software, base.service, base.counter):
        bus.subscribe(follower.on_event)
    return FollowerParts(news, software, clock, RefusalRetry(snapshot, amounts, bus.emit, places))
