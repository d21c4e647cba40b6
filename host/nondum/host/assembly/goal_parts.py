"""Makes what takes goals: from people's tools and words, and from payloads."""

from __future__ import annotations

from collections.abc import Callable

from nondum.host.assembly.base import Base
from nondum.host.assembly.stop_parts import StopAll
from nondum.host.control.goal_orders import GoalOrders
from nondum.host.control.news import News
from nondum.host.core.elsewhere import Elsewhere
from nondum.host.mind.mind import Mind
from nondum.host.people.conversation import Reply, Take
from nondum.host.people.goal_files import GoalFiles
from nondum.host.people.stopping import Stopping
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen


@frozen
class GoalParts:
    """What takes goals."""

    orders: GoalOrders
    files: GoalFiles


def make_goals(
    base: Base,
    workers: Workers,
    mind: Mind,
    news: News,
    *,
    stopping: Stopping,
    stop_all: StopAll,
    answer: Reply,
    take: Take,
    on_change: Callable[[], None],
    elsewhere: Elsewhere | None,
) -> GoalParts:
    """Make what takes goals, and subscribe it. `on_change` is called when other words are kept for
    later."""
    catalogue = base.catalogue
    orders = GoalOrders(
        catalogue,
        mind,
        workers,
        news,
        stopping,
        stop_all,
        answer,
        take,
        base.config.planning.translate_s,
        lambda: files,
        elsewhere,
    )
    files = GoalFiles(
        catalogue.snapshot, mind, orders.translated, base.bus.emit, on_change, elsewhere
    )
    base.bus.subscribe(files.on_event)
    return GoalParts(orders, files)
