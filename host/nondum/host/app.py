"""The composition root: every part of a running host is made and tied together here.

Events go one way, over the bus: sources, workers and people emit; the component manager commits
what changes the catalogue; the mind listens.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nondum.host import verbs
from nondum.host.catalogue import backups, opening
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.config.host_config import HostConfig
from nondum.host.control import machine
from nondum.host.control.news import News
from nondum.host.control.orders import Orders
from nondum.host.control.questions import Questions
from nondum.host.control.server import ControlServer
from nondum.host.control.trust_orders import TrustOrders
from nondum.host.core.bus import Bus
from nondum.host.core.events import (
    DriveRemoved,
    Event,
    HostStarted,
    PayloadActivated,
    PayloadWithdrawn,
    Recomposed,
    RetryAsked,
)
from nondum.host.core.keyed_queues import in_thread
from nondum.host.core.records import Safety
from nondum.host.extension.hookspecs import Host
from nondum.host.extension.loading import Extensions
from nondum.host.jobs.children import watched_without_threads
from nondum.host.lifecycle import crash_attribution, safe_mode
from nondum.host.lifecycle.advance import RULES
from nondum.host.manager import automatic_retry, state_lock
from nondum.host.manager.component_manager import ComponentManager
from nondum.host.manager.crash_loop import CrashCounter
from nondum.host.manager.effect_handlers import Executor
from nondum.host.manager.installation import InstallOptions
from nondum.host.manager.payload_trust import TrustOptions
from nondum.host.manager.refusal_retry import RefusalRetry
from nondum.host.manager.state_folders import Folders, let_pass, make_private, remove_temporary
from nondum.host.mind.frames import mounts_of_all
from nondum.host.mind.mind import Mind
from nondum.host.mind.mounts import MountUpdates
from nondum.host.mind.planners import Planners
from nondum.host.mind.system_tree import load_system_tree
from nondum.host.people.announcements import announced
from nondum.host.people.answering import Answering
from nondum.host.people.conversation import Conversation, Take, wanted
from nondum.host.people.feedback import parts as feedback_parts
from nondum.host.people.goal_files import GoalFiles, of_people
from nondum.host.people.stop_button.button import StopButton
from nondum.host.people.stop_button.hook import StopHook
from nondum.host.people.stopping import Stopped, Stopping, is_stop_for_stranger, said_to
from nondum.host.sandbox.cgroups import Cgroups
from nondum.host.sandbox.helper import privileged
from nondum.host.service import malloc
from nondum.host.service.notify import Notifier
from nondum.host.service.service import Part, Service
from nondum.host.service.stop_signals import told_to_stop
from nondum.host.service.words import words
from nondum.host.sources.devices.slots import DeviceSlotSource
from nondum.host.sources.devices.software import Software
from nondum.host.sources.devices.source import DeviceSource
from nondum.host.sources.devices.udev import UdevSource
from nondum.host.sources.drives.blocks import BlockSource
from nondum.host.sources.drives.debounce import Debounced
from nondum.host.sources.drives.slots import SlotSource
from nondum.host.sources.drives.source import DriveSource
from nondum.host.trust.clock import ClockWatch
from nondum.host.workers import confinement_choice
from nondum.host.workers.confinements import changes_user
from nondum.host.workers.launcher import WorkerLauncher
from nondum.host.workers.spec import Limits, Timing
from nondum.host.workers.workers import Workers
from nondum.planning.execute.attempts import Patience
from nondum.planning.words.stop_words import is_stop
from nondum.sdk.errors import ConfigRefused, NondumError, Problem

if TYPE_CHECKING:
    from nondum.host.peers.peer_services import PeerServices

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
    _make_slots(config)
    folders = Folders(config.host.state)
    held = await state_lock.lock(folders.root, service.waits)
    ending = asyncio.create_task(_when(stop, held.will_end))
    try:
        await in_thread(make_private, folders)
        await in_thread(remove_temporary, folders)
        counter = CrashCounter(folders.root)
        safety = await in_thread(counter.begin, asked)
        keep = config.journal.keep
        catalogue = await Catalogue.open(folders.catalogue, config.host.name, keep=keep)
        try:
            host = RunningHost(service, config, folders, catalogue)
            await host.make(counter, safety, more_drives)
            await host.run(stop)
            await in_thread(counter.clear)
        finally:
            await catalogue.close()
    finally:
        ending.cancel()
        held.release()


class RunningHost:
    """The parts of a host that runs, made from the innermost out; each may use those before it."""

    def __init__(
        self, service: Service, config: HostConfig, folders: Folders, catalogue: Catalogue
    ) -> None:
        self.service, self.config, self.folders = service, config, folders
        self.catalogue = catalogue
        self.bus = Bus(RULES)
        self.extensions = Extensions()

    async def make(
        self,
        counter: CrashCounter,
        safety: tuple[Safety, str],
        more_drives: Sequence[DriveSource],
    ) -> None:
        """Make everything. Raises `ConfigRefused`, `PeerRefused`."""
        self.counter, self.why_safe = counter, safety[1]
        await self._make_workers()
        self._make_manager(safety, more_drives)
        self.stop_hook = StopHook(self.config.stop)
        self.stopping = Stopping(lambda: self.mind, self.workers, self.stop_hook.run_soon)
        self.peers = await self._peers()
        self._make_mind()
        self._make_followers()
        self._make_conversation()
        self._make_feedback()
        self._make_orders()
        self._make_control()

    async def _make_workers(self) -> None:
        config, folders = self.config, self.folders
        sections = config.workers
        timing = Timing(startup_s=sections.startup_s, settle_beats=sections.settle_beats)
        self.cgroups = await in_thread(_cgroups, folders)
        self.confinement_state = await in_thread(
            confinement_choice.confinement_state,
            sections.confinement,
            sections.minimum_confinement,
            folders.confinement,
            folders.probes,
        )
        confinement = confinement_choice.confinement(self.confinement_state, folders.of_workers)
        if changes_user(confinement):
            await in_thread(let_pass, folders)
        launcher = WorkerLauncher(confinement, self.cgroups, folders.scratches, timing.startup_s)
        self.workers = Workers(config.host.name, self.bus.emit, launcher=launcher, timing=timing)

    def _make_manager(self, safety: tuple[Safety, str], more_drives: Sequence[DriveSource]) -> None:
        config, bus = self.config, self.bus
        options = _install_options(config)
        self.executor = Executor(config.host.name, self.folders, self.workers, bus.emit, options)
        self.manager = ComponentManager(self.catalogue, self.executor, bus)
        self.manager.leave_alone(*safety)
        self.drives, self.devices = drive_sources(config, self.folders), device_sources(config)
        for source in (*self.drives, *more_drives):
            self.manager.add_source(source)

    async def _peers(self) -> PeerServices | None:
        """What this host has to do with others; None where it is to have nothing. Imported only
        where it is wanted: it needs some ten megabytes.

        Raises `PeerRefused`.
        """
        if not self.config.peers.enabled:
            return None
        from nondum.host.peers.peer_services import PeerServices

        return await PeerServices.open(
            self.config,
            self.folders,
            self.workers,
            self.catalogue,
            self.bus.emit,
            lambda: self.mind,
            self.stopping.stop,
            lambda words: self.answering.own(words),
            self.executor.children,
            self.executor.judged_by,
        )

    def _make_mind(self) -> None:
        config, planning = self.config, self.config.planning
        patience = Patience(establish_s=planning.establish_s, finish_s=planning.finish_s)
        self.mind = Mind(
            config.host.name,
            self.peers.calls if self.peers else self.workers,
            _planners(config, self.extensions, self.folders.planning),
            emit=self.bus.emit,
            ask=self.workers.ask,
            deadline_s=planning.deadline_s,
            patience=patience,
            system_tree=load_system_tree(config.host.system_tree),
        )

    def _make_followers(self) -> None:
        """What follows events, in the order in which it is told of them."""
        snapshot, emit = self.catalogue.snapshot, self.bus.emit
        self.news = News()
        self.software = Software(snapshot, self.mind.people.tell)
        self.clock = ClockWatch(lambda: self.executor.trust.trust, emit)
        amounts = self.executor.installation.amounts
        self.refusal_retry = RefusalRetry(snapshot, amounts, emit, lambda: self.places())
        self.bus.subscribe(_Listener(self.catalogue, self.mind, self.workers).on_event)
        if self.peers is not None:
            self.bus.subscribe(self.peers.on_event)
        for follower in (self.news, self.software, self.service, self.counter):
            self.bus.subscribe(follower.on_event)

    def _make_conversation(self) -> None:
        ask = self.peers.asking.ask if self.peers else None
        self.answering = Answering(
            self.mind, lambda: self.catalogue.snapshot().payloads, self.workers.busy, ask
        )
        self.conversation = Conversation(
            self.mind,
            self.workers.pids,
            lambda words: self.orders.take_words(words),
            self.answering.answer,
        )

    def _make_feedback(self) -> None:
        """What extensions show and follow."""
        snapshot, told = self.catalogue.snapshot, self.mind.people.newest
        host = Host(self.config, self.folders.root, snapshot, self.conversation.say, told)
        for listener in self.extensions.asked("listeners", host=host):
            self.bus.subscribe(listener)
        self.feedback = feedback_parts.made(
            self.config.feedback,
            self.catalogue,
            self.mind,
            self.places,
            lambda: self.goal_files.state_reasons,
            self.extensions.asked("feedback_outputs", host=host),
            self.news.look_again,
        )
        self.bus.subscribe(self.feedback.on_event)

    def _make_orders(self) -> None:
        stop_all = _stop_all(self.peers, self.stopping)
        self.stop_button = StopButton(self.config.stop, lambda: _pressed(self.mind, stop_all))
        self.orders = Orders(
            self.catalogue,
            self.mind,
            self.workers,
            self.news,
            self.bus,
            self.stopping,
            stop_all,
            self.answering.answer,
            _take(self.peers, self.mind, self.stopping),
            self.config.planning.translate_s,
            lambda: self.goal_files,
            self.peers.goals if self.peers else None,
        )
        self.goal_files = GoalFiles(
            self.catalogue.snapshot,
            self.mind,
            self.orders.translated,
            self.bus.emit,
            self.feedback.wake,
            self.peers.goals if self.peers else None,
        )
        self.bus.subscribe(self.goal_files.on_event)

    def _make_control(self) -> None:
        trust, reserve_mb = self.executor.trust, self.config.install.reserve_mb
        self.questions = Questions(
            self.catalogue,
            self.mind,
            self.workers,
            self.confinement_state,
            self.news,
            self.executor.installation.listing,
            self.warnings,
            self.places,
            trust.vouched,
            self.feedback.to_dict,
            trust.summary,
            self.peers.goals if self.peers else None,
            lambda: machine.look(self.folders.root, reserve_mb),
            lambda: slot_problems(self.devices),
        )
        trust_orders = TrustOrders(trust, self.bus.emit)
        self.control = ControlServer(
            self.config.host.control,
            verbs.answering(self.questions, self.orders, trust_orders, self.peers),
            verbs.following(self.questions, self.orders, self.peers),
        )

    def places(self) -> Mapping[str, str]:
        """The payloads that run on peers: key → name of the peer."""
        return self.peers.placement.places() if self.peers else {}

    def warnings(self) -> tuple[str, ...]:
        """What every status warns of."""
        return (
            *self.executor.trust.warnings,
            *map(str, self.clock.problems),
            *_warnings(self.catalogue, self.why_safe),
            *self.counter.warnings(),
            *crash_attribution.counts(self.catalogue.snapshot()),
            *self.confinement_state.warnings(),
            *self.feedback.warnings,
            *self.stop_hook.warnings,
            *self.stop_button.warnings,
            *map(str, self.cgroups.problems()),
            *map(str, self.extensions.problems),
            *map(str, (*slot_problems(self.drives), *slot_problems(self.devices))),
            *(self.peers.warnings if self.peers else ()),
        )

    async def run(self, stop: asyncio.Event) -> None:
        """Serve until `stop`, and leave everything safe."""
        await self.control.open()
        name, at = self.config.host.name, self.config.host.control
        log.info("host %s listens at %s", name, at)
        try:
            await self.workers.keep_spare()
            if self.peers is not None:
                await self.peers.start()
            malloc.keep_what_is_loaded()
            await _until(stop, *self._tasks())
        finally:
            await self.control.close()
            await self.stop_hook.close()
            await self.mind.close()
            if self.peers is not None:
                await self.peers.close()
            await self.workers.close()
            await in_thread(self.cgroups.close)

    def _tasks(self) -> Iterator[Coroutine[Any, Any, None]]:
        """What runs as long as the host."""
        catalogue, bus, mind = self.catalogue, self.bus, self.mind
        every_s = self.config.backups.every_s
        watched = (
            Part("the component manager", lambda: bus.taken, lambda: bus.followed),
            Part("the mind", lambda: mind.ticks + 1, lambda: mind.ticks),
        )

        def status() -> str:
            goals, warnings = mind.views.given(), self.warnings()
            return words(catalogue.snapshot(), goals, self.places(), warnings)

        yield self.manager.run()
        yield mind.run()
        yield backups.keep(catalogue.backups, lambda: catalogue.revision, every_s)
        yield self.software.run()
        yield self.counter.outlive()
        yield self.service.watched(watched)
        yield self.service.told(status, self.questions.changed)
        yield self.conversation.run()
        yield self.stop_button.run()
        yield self.feedback.run()
        yield self.goal_files.run()
        yield self.refusal_retry.run()
        yield self.clock.run()
        yield automatic_retry.hold(catalogue.snapshot, self.counter, bus.emit)
        for source in self.devices:
            yield source.watch(bus.emit)


def _cgroups(folders: Folders) -> Cgroups:
    """Cgroups of workers, made by this process or the helper. The last daemon's are ended."""
    cgroups = Cgroups.open(folders.root)
    if not cgroups.holds:
        try:
            cgroups = Cgroups(privileged().cgroups())
        except NondumError as error:
            log.warning("%s", error)
    cgroups.sweep()
    return cgroups


def _take(neighbours: PeerServices | None, mind: Mind, stopping: Stopping) -> Take:
    """What becomes of words that are heard."""
    if neighbours is not None:
        return neighbours.goals.take

    async def taken(words: str) -> str:
        _, said = said_to(words, [mind.beliefs.snapshot.host], mind)
        is_for_all = is_stop(said) or is_stop_for_stranger(said, mind)
        return str(stopping.stop()) if is_for_all else wanted(mind, said)

    return taken


async def _pressed(mind: Mind, stop_all: Callable[[], Awaitable[Stopped]]) -> None:
    """The stop key was pressed."""
    mind.people.tell(f"the stop key: {await stop_all()}")


def _stop_all(
    neighbours: PeerServices | None, stopping: Stopping
) -> Callable[[], Awaitable[Stopped]]:
    if neighbours is not None:
        return neighbours.goals.stop_all

    async def alone() -> Stopped:
        return stopping.stop()

    return alone


def drive_sources(config: HostConfig, folders: Folders) -> list[DriveSource]:
    """Where this host's drives come from."""
    sources: list[DriveSource] = []
    if config.drives.slots:
        sources.append(SlotSource(config.drives.slots))
    if config.drives.block_devices:
        single_function = config.drives.single_function
        mounts = privileged().mounts(folders.mounts)
        sources.append(Debounced(BlockSource(mounts, single_function=single_function)))
    return sources


def device_sources(config: HostConfig) -> list[DeviceSource]:
    """Where this host's devices come from."""
    sources: list[DeviceSource] = []
    if config.devices.slots:
        sources.append(DeviceSlotSource(config.devices.slots))
    if config.devices.udev:
        sources.append(UdevSource())
    return sources


def slot_problems(sources: Sequence[DriveSource | DeviceSource]) -> tuple[Problem, ...]:
    """What is wrong in the slot folders among some sources."""
    slots = (one for one in sources if isinstance(one, SlotSource | DeviceSlotSource))
    return tuple(problem for one in slots for problem in one.problems)


def _make_slots(config: HostConfig) -> None:
    """Make the folders that are watched. Raises `ConfigRefused` (CONFIG_FOLDER)."""
    problems = []
    for section in ("drives", "devices"):
        for folder in getattr(config, section).slots:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                text = f"cannot be a folder of slots ({error.strerror})"
                fix = f"see `slots` under [{section}]"
                problems.append(Problem("CONFIG_FOLDER", text, where=str(folder), fix=fix))
    if problems:
        raise ConfigRefused(*problems)


_ENDS = DriveRemoved | PayloadWithdrawn | PayloadActivated | RetryAsked
"""What was told of a drive or payload before these is of no interest any more."""


def _planners(config: HostConfig, extensions: Extensions, temporary: Path) -> Planners:
    """The planners of all extensions, or those that the configuration names.

    Raises `ConfigRefused` (CONFIG_PLANNER).
    """
    found: dict[str, str] = dict(extensions.asked("planners"))
    wanted = config.planning.planners
    if unknown := [name for name in wanted if name not in found]:
        known = ", ".join(sorted(found)) or "none"
        text = f"no planner {unknown[0]!r} is installed"
        problem = Problem("CONFIG_PLANNER", text, where="planning.planners", have=known)
        raise ConfigRefused(problem)
    chosen = {name: found[name] for name in wanted or found}
    return Planners.of(chosen, memory_mb=config.planning.memory_mb, temporary=temporary)


class _Listener:
    """Tells mind and workers what the bus tells."""

    def __init__(self, catalogue: Catalogue, mind: Mind, workers: Workers) -> None:
        self._catalogue, self._mind, self._workers = catalogue, mind, workers
        self._mounts = MountUpdates(workers.remount, mind.after_tick)

    def on_event(self, event: Event) -> None:
        """A start or a recomposition is a new snapshot; everything else is news."""
        if isinstance(event, HostStarted | Recomposed):
            snapshot = self._catalogue.snapshot()
            self._mounts.see(mounts_of_all(snapshot))
            self._workers.streams.connect(dict(snapshot.connections))
            self._mind.see(snapshot)
            if isinstance(event, HostStarted):
                self._mind.restore(of_people(snapshot.goals))
            return
        about = _about(event)
        if isinstance(event, _ENDS):
            self._mind.people.end(about)
        sentence = announced(event, self._catalogue.snapshot())
        if sentence is not None:
            is_gone = isinstance(event, DriveRemoved | PayloadWithdrawn)
            self._mind.people.tell(sentence, "" if is_gone else about)
        self._mind.on_event(event)


def _about(event: Event) -> str:
    """The drive or payload that an event is about, if it is about one."""
    names = ((kind, getattr(event, kind, "")) for kind in ("drive", "payload"))
    return next((f"{kind} {name}" for kind, name in names if name), "")


def _install_options(config: HostConfig) -> InstallOptions:
    return InstallOptions(
        allow_unsigned=config.drives.allow_unsigned,
        look_s=config.drives.look_s,
        trust=TrustOptions(config.first_trust_file, stop=config.trust.on_revoke == "stop"),
        method=config.install.method,
        reserve_mb=config.install.reserve_mb,
        quota_mb=config.install.quota_mb,
        limits=Limits(
            memory_mb=config.workers.memory_mb,
            tasks=config.workers.tasks,
            descriptors=config.workers.descriptors,
            processors=config.workers.cpu_percent / 100,
            scratch_mb=config.workers.scratch_mb,
        ),
    )


def _warnings(catalogue: Catalogue, why_safe: str) -> Iterator[str]:
    if (safety := catalogue.snapshot().safety) is not Safety.OFF:
        yield str(safe_mode.problem(safety, why=why_safe))
    if catalogue.loss is not None:
        yield str(opening.problem_of(catalogue.loss, ()))
    if catalogue.unwritten is not None:
        yield str(catalogue.unwritten)


async def _when(event: asyncio.Event, function: Callable[[], None]) -> None:
    """Call a function once an event is set."""
    await event.wait()
    function()


async def _until(stop: asyncio.Event, *parts: Coroutine[Any, Any, None]) -> None:
    """Run all parts until one fails or `stop` is set; then let all of them end."""
    async with asyncio.TaskGroup() as group:
        tasks = [group.create_task(part) for part in parts]
        group.create_task(_cancel_when(stop, tasks))


async def _cancel_when(stop: asyncio.Event, tasks: list[asyncio.Task[None]]) -> None:
    await stop.wait()
    for task in tasks:
        task.cancel()
