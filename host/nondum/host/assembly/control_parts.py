"""Makes what people's tools talk to: the control socket, its questions and its orders."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from nondum.host import verbs
from nondum.host.assembly.base import Base
from nondum.host.assembly.manager_parts import ManagerParts
from nondum.host.assembly.sources import Sources
from nondum.host.assembly.worker_parts import WorkerParts
from nondum.host.control import machine
from nondum.host.control.device_questions import DeviceQuestions
from nondum.host.control.goal_orders import GoalOrders
from nondum.host.control.log_questions import LogQuestions
from nondum.host.control.mind_questions import MindQuestions
from nondum.host.control.mount_orders import MountOrders
from nondum.host.control.news import News
from nondum.host.control.payload_orders import PayloadOrders
from nondum.host.control.server import ControlServer
from nondum.host.control.status_questions import StatusQuestions
from nondum.host.control.stream_orders import StreamOrders
from nondum.host.control.stream_questions import StreamQuestions
from nondum.host.control.trust_orders import TrustOrders
from nondum.host.control.watching import Watching
from nondum.host.mind.mind import Mind
from nondum.host.people.feedback.feedback import Feedback
from nondum.host.workers.workers import Workers
from nondum.sdk.frozen import frozen

if TYPE_CHECKING:
    from nondum.host.peers.peer_services import PeerServices


@frozen
class ControlParts:
    """What people's tools talk to."""

    server: ControlServer
    watching: Watching


def make_control(
    base: Base,
    workers: Workers,
    mind: Mind,
    news: News,
    *,
    status: StatusQuestions,
    managed: ManagerParts,
    sources: Sources,
    peers: PeerServices | None,
    goals: GoalOrders,
    places: Callable[[], Mapping[str, str]],
) -> ControlParts:
    """Make the control socket; it is not open yet."""
    catalogue, bus = base.catalogue, base.bus
    streams, logs = StreamQuestions(workers), LogQuestions(catalogue, workers)
    of_mind = MindQuestions(catalogue, mind, places, peers.goals if peers else None)
    watching = Watching(mind, news, status, streams)
    payloads = PayloadOrders(catalogue, news, bus)
    answering = verbs.answering(
        status,
        DeviceQuestions(catalogue, sources.device_problems),
        streams,
        logs,
        of_mind,
        goals,
        payloads,
        MountOrders(catalogue, mind, news, bus),
        StreamOrders(catalogue, mind, workers, news, bus),
        TrustOrders(managed.executor.trust, bus.emit),
        peers=peers,
    )
    following = verbs.following(logs, of_mind, watching, payloads, peers=peers)
    return ControlParts(ControlServer(base.config.host.control, answering, following), watching)


def make_status(
    base: Base,
    mind: Mind,
    news: News,
    *,
    confined: WorkerParts,
    managed: ManagerParts,
    feedback: Feedback,
    places: Callable[[], Mapping[str, str]],
    warnings: Callable[[], tuple[str, ...]],
) -> StatusQuestions:
    """Make what answers how the host is."""
    trust, reserve_mb = managed.executor.trust, base.config.install.reserve_mb
    return StatusQuestions(
        base.catalogue,
        mind,
        confined.workers,
        confined.confinement,
        news,
        managed.executor.installation.listing,
        warnings,
        places,
        trust.vouched,
        feedback.to_dict,
        trust.summary,
        lambda: machine.look(base.folders.root, reserve_mb),
    )
