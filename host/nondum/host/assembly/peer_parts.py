"""Makes what this host has to do with others, where it is to have anything to do with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from nondum.host.assembly.base import Base
from nondum.host.manager.effect_handlers import Executor
from nondum.host.mind.mind import Mind
from nondum.host.people.conversation import Reply
from nondum.host.people.stopping import Stopped
from nondum.host.workers.workers import Workers

if TYPE_CHECKING:
    from nondum.host.peers.peer_services import PeerServices


async def make_peers(
    base: Base,
    workers: Workers,
    executor: Executor,
    *,
    mind: Callable[[], Mind],
    stop: Callable[[], Stopped],
    answer: Reply,
) -> PeerServices | None:
    """Make the peer services; None where there are to be none. Imported only where they are
    wanted: they need some ten megabytes. `mind` and `answer` are asked for once the host runs.

    Raises `PeerRefused`.
    """
    if not base.config.peers.enabled:
        return None
    from nondum.host.peers.fleet_transport import chosen
    from nondum.host.peers.peer_services import PeerServices

    return await PeerServices.open(
        base.config,
        chosen(base.extensions, base.config),
        base.folders,
        workers,
        base.catalogue,
        base.bus.emit,
        mind,
        stop,
        answer,
        executor.children,
        executor.judged_by,
    )
