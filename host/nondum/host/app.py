"""The composition root: the parts of a running host, made by `assembly/` and tied together here.

Events go one way, over the bus: sources, workers and people emit; the component manager commits
what changes the catalogue; the mind listens.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nondum.host.assembly import status_warnings
from nondum.host.assembly.base import Base
from nondum.host.assembly.control_parts import ControlParts, make_control, make_status
from nondum.host.assembly.conversation_parts import make_conversation
from nondum.host.assembly.feedback_parts import make_feedback
from nondum.host.assembly.follower_parts import make_followers
from nondum.host.assembly.goal_parts import GoalParts, make_goals
from nondum.host.assembly.manager_parts import make_manager
from nondum.host.assembly.mind_parts import make_mind
from nondum.host.assembly.peer_parts import make_peers
from nondum.host.assembly.running import run_until, when
from nondum.host.assembly.sources import make_slot_folders, make_sources
from nondum.host.assembly.stop_parts import make_stop_button, make_stopping, stop_all, take
from nondum.host.assembly.worker_parts import make_workers
from nondum.host.catalogue import backups
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.host_config import HostConfig
from nondum.host.core.bus import Bus
from nondum.host.core.keyed_queues import in_thread
from nondum.host.core.records.safety import Safety
from nondum.host.extension.loading import Extensions
from nondum.host.jobs.children import watched_without_threads
from nondum.host.lifecycle import crash_attribution
from nondum.host.lifecycle.advance import RULES
from nondum.host.manager import automatic_retry, state_lock
from nondum.host.manager.crash_loop import CrashCounter
from nondum.host.manager.state_folders import Folders, make_private, remove_temporary
from nondum.host.people.feedback.feedback import Feedback
from nondum.host.service import malloc
from nondum.host.service.notify import Notifier
from nondum.host.service.service import Part, Service
from nondum.host.service.stop_signals import told_to_stop
from nondum.host.service.words import words
from nondum.host.sources.drives.source import DriveSource

if TYPE_CHECKING:
    pass

log = logging.getLogger(__name__)


async def run_host(
    config: HostConfig,
    *,
    more_drives: Sequence[DriveSource] = (),
    safety: Safety = Safety.OFF,
    notifier: Notifier | None = None,
) -> None:
    """Run a host until SIGTERM or SIGINT. `more_drives` are sources beside the configuration's;
    `safety` is asked for by a person; `notifier` tells a service manager how it is.

    Raises `ConfigRefused` (ALREADY_RUNNING, STATE_BUSY, SYSTEM_TREE, …) before anything has begun.
    """
    with told_to_stop() as stop, watched_without_threads():
        async with Service(notifier or Notifier()) as service:
            await _run_as(service, config, more_drives, safety, stop)


async def _run_as(
    service: Service,
    config: HostConfig,
    more_drives: Sequence[DriveSource],
    asked: Safety,
    stop: asyncio.Event,
) -> None:
    malloc.give_back_what_is_big()
    make_slot_folders(config)
    folders = Folders(config.host.state)
    held = await state_lock.lock(folders.root, service.waits)
    ending = asyncio.create_task(when(stop, held.will_end))
    try:
        await in_thread(make_private, folders)
        await in_thread(remove_temporary, folders)
        counter = CrashCounter(folders.root)
        safety = await in_thread(counter.begin, asked)
        keep = config.journal.keep
        catalogue = await Catalogue.open(folders.catalogue, config.host.name, keep=keep)
        try:
            base = Base(config, folders, catalogue, Bus(RULES), Extensions(), service, counter)
            host = RunningHost(base)
            await host.make(safety, more_drives)
            await host.run(stop)
            await in_thread(counter.clear)
        finally:
            await catalogue.close()
    finally:
        ending.cancel()
        held.release()


class RunningHost:
    """The parts of a host that runs, made from the innermost out; each may use those before it."""

    def __init__(self, base: Base) -> None:
        self.base = base

    async def make(self, safety: tuple[Safety, str], more_drives: Sequence[DriveSource]) -> None:
        """Make everything; `safety` is which payloads are left alone, and why.

        Raises `ConfigRefused`, `PeerRefused`.
        """
        base, self.why_safe = self.base, safety[1]
        self.confined = await make_workers(base)
        self.workers = self.confined.workers
        self.sources = make_sources(base.config, base.folders)
        drives = (*self.sources.drives, *more_drives)
        self.managed = make_manager(base, self.workers, safety, drives)
        executor = self.managed.executor
        self.stops = make_stopping(base, self.workers, lambda: self.mind)
        self.peers = await make_peers(
            base,
            self.workers,
            executor,
            mind=lambda: self.mind,
            stop=self.stops.stopping.stop,
            answer=lambda words: self.talk.answering.own(words),
        )
        calls = self.peers.calls if self.peers else self.workers
        self.mind = make_mind(base, self.workers, calls)
        self.followers = make_followers(
            base, self.workers, executor, self.mind, self.peers, self.places
        )
        self.talk = make_conversation(
            self.workers,
            self.mind,
            self.peers,
            take=lambda words: self.goals.orders.take_words(words),
            known=lambda: self.feedback.known(),
        )
        self.feedback = self._make_feedback()
        self.stop_all = stop_all(self.peers, self.stops.stopping)
        self.stop_button = make_stop_button(base, self.mind, self.stop_all)
        self.goals = self._make_goals()
        self.control = self._make_control()

    def _make_feedback(self) -> Feedback:
        return make_feedback(
            self.base,
            self.mind,
            say=self.talk.conversation.say,
            places=self.places,
            more=lambda: self.goals.files.state_reasons,
            on_change=self.followers.news.look_again,
        )

    def _make_goals(self) -> GoalParts:
        return make_goals(
            self.base,
            self.workers,
            self.mind,
            self.followers.news,
            stopping=self.stops.stopping,
            stop_all=self.stop_all,
            answer=self.talk.answering.answer,
            take=take(self.peers, self.mind, self.stops.stopping),
            on_change=self.feedback.wake,
            elsewhere=self.peers.goals if self.peers else None,
        )

    def _make_control(self) -> ControlParts:
        news = self.followers.news
        status = make_status(
            self.base,
            self.mind,
            news,
            confined=self.confined,
            managed=self.managed,
            feedback=self.feedback,
            places=self.places,
            warnings=self.warnings,
        )
        return make_control(
            self.base,
            self.workers,
            self.mind,
            news,
            status=status,
            managed=self.managed,
            sources=self.sources,
            peers=self.peers,
            goals=self.goals.orders,
            places=self.places,
        )

    def places(self) -> Mapping[str, str]:
        """The payloads that run on peers: key → name of the peer."""
        return self.peers.placement.places() if self.peers else {}

    def warnings(self) -> tuple[str, ...]:
        """What every status warns of."""
        return (
            *self.managed.executor.trust.warnings,
            *map(str, self.followers.clock.problems),
            *status_warnings.of_catalogue(self.base.catalogue, self.why_safe),
            *self.base.counter.warnings(),
            *crash_attribution.counts(self.base.catalogue.snapshot()),
            *self.confined.confinement.warnings(),
            *self.feedback.warnings,
            *self.stops.hook.warnings,
            *self.stop_button.warnings,
            *map(str, self.confined.cgroups.problems()),
            *map(str, self.base.extensions.problems),
            *map(str, self.sources.problems()),
            *(self.peers.warnings if self.peers else ()),
        )

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop`, and leave everything safe."""
        await self.control.server.open()
        own = self.base.config.host
        log.info("host %s listens at %s", own.name, own.control)
        try:
            if self.base.forks_stay is None:
                await self.workers.keep_spare()
            if self.peers is not None:
                await self.peers.start()
            malloc.keep_what_is_loaded()
            await run_until(stop, *self._tasks())
        finally:
            await self.control.server.close()
            await self.stops.hook.close()
            await self.mind.close()
            if self.peers is not None:
                await self.peers.close()
            await self.confined.close()

    def _tasks(self) -> Iterator[Coroutine[Any, Any, None]]:
        """What runs as long as the host."""
        base, catalogue, mind = self.base, self.base.catalogue, self.mind
        every_s = base.config.backups.every_s
        watched = (
            Part("the component manager", lambda: base.bus.taken, lambda: base.bus.followed),
            Part("the mind", lambda: mind.ticks + 1, lambda: mind.ticks),
        )

        def status() -> str:
            goals, warnings = mind.views.given(), self.warnings()
            return words(catalogue.snapshot(), goals, self.places(), warnings)

        yield self.managed.manager.run()
        yield mind.run()
        yield backups.keep(catalogue.backups, lambda: catalogue.revision, every_s)
        yield self.followers.software.run()
        yield base.counter.outlive()
        yield base.service.watched(watched)
        yield base.service.told(status, self.control.watching.changed)
        yield self.talk.conversation.run()
        yield self.stop_button.run()
        yield self.feedback.run()
        yield self.goals.files.run()
        yield self.followers.refusal_retry.run()
        yield self.followers.clock.run()
        yield automatic_retry.hold(catalogue.snapshot, base.counter, base.bus.emit)
        for source in self.sources.devices:
            yield source.watch(base.bus.emit)
