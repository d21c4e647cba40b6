"""The host's configuration: its sections, and every key with its default."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from dataclasses import MISSING, field, fields
from pathlib import Path
from typing import Any, get_type_hints

from nondum.host.config import control_sockets
from nondum.host.config.confinement_level import Wanted
from nondum.host.config.feedback_section import FeedbackSection
from nondum.host.config.stop_section import StopSection
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.confinement import Level

SYSTEM_FILE = Path("/etc/nondum/host.toml")


@frozen
class HostSection:
    """Who this host is, and where it keeps what it knows."""

    name: str = field(default_factory=lambda: default_name(socket.gethostname()))
    """Name of the host, and of its body's frame: lower-case letters, digits and single hyphens.
    Without one it is made of the machine's."""
    state: Path = Path("/var/lib/nondum")
    """Folder of catalogue, store and venvs."""
    control: Path = Path(control_sockets.SYSTEM)
    """The control socket."""
    system_tree: str = "nondum.host.mind.system_tree:default_tree"
    """`package:function` that makes the system tree."""
    keep_ready_above_mb: int = 2048
    """A machine with more memory keeps processes ready for what is plugged in or wanted next, which
    take some 45 MB; another one starts them when they are needed, keeps them while a goal is given
    or another host is there, and ends them half a minute later."""


@frozen
class DrivesSection:
    """Where drives come from, and what is asked of them."""

    slots: tuple[Path, ...] = ()
    """Folders whose entries stand for drives."""
    block_devices: bool = True
    """Mount USB drives; needs root."""
    single_function: bool = True
    """Refuse USB drives that are something else too, such as a keyboard or a network adapter."""
    allow_unsigned: bool = False
    """Accept payloads without a signature: for development; every status says so."""
    look_s: float = 10.0
    """A drive that cannot be mounted and listed in this time hangs; more on a computer that has
    much else to do."""


@frozen
class TrustSection:
    """Whose payloads are run."""

    file: Path | None = Path("/etc/nondum/trust.toml")
    """The first trust file, which `nondum keys trust` writes with its signatures. Without them,
    who may write there vouches for it. With `--user`: `trust.toml` in the state folder."""
    on_revoke: str = "stop"
    """What becomes of payloads that are here and not trusted any more. `stop`: they are withdrawn.
    `flag`: it is told only."""


@frozen
class DevicesSection:
    """Where devices come from."""

    slots: tuple[Path, ...] = ()
    """Folders of TOML files that stand for devices."""
    udev: bool = True
    """Follow the machine's own devices."""


@frozen
class JournalSection:
    """What is kept of what happened."""

    keep: int = 20_000
    """Entries; of older ones the oldest go first. At least 1000 are kept."""


@frozen
class BackupsSection:
    """Copies of the catalogue, for the day on which its file is damaged."""

    every_s: float = 900.0
    """Time between two, if anything changed; the last two are kept."""


@frozen
class InstallSection:
    """How payloads become venvs."""

    method: str = "store"
    """`store`: hard links from the store. `pip`: pip itself."""
    reserve_mb: int = 64
    """Disk that is left free whatever is plugged in."""
    quota_mb: int = 4096
    """Size that wheels and data in the store are pruned to, least recently used first."""


@frozen
class WorkersSection:
    """Limits of each worker. A payload may ask for others (`[component.limits]`), up to the most
    that is set here and that its signer's role may give."""

    memory_mb: int = 2048
    """Memory of all its processes, where the machine has the memory cgroup; else the data of each,
    and what all of them hold whenever that is looked at."""
    tasks: int = 256
    """Processes and threads."""
    descriptors: int = 1024
    """Open files, sockets and streams, of each process."""
    cpu_percent: int = 0
    """Processor time of all its processes, in per cent of one processor; 0: no limit."""
    scratch_mb: int = 256
    """Disk that its scratch folder may take; more ends it, and the folder is emptied."""
    startup_s: float = 30.0
    """What a plugin has from its launch until it has started; then it counts as hung."""
    most_memory_mb: int = 0
    """The most memory that a payload may ask for a worker; 0: as much as is free."""
    most_tasks: int = 4096
    """The most processes and threads that a payload may ask for a worker."""
    most_numeric_threads: int = 0
    """The most threads of each numeric library that a payload may ask for a worker, which has one
    otherwise; 0: as many as the machine has processors."""
    most_startup_s: int = 600
    """The longest time to start that a payload may ask for a worker."""
    most_scratch_mb: int = 4096
    """The largest scratch folder that a payload may ask for a worker."""
    settings: Path | None = None
    """File with settings of components, over those of their payloads, read again for each payload
    that is plugged in: see above."""
    settle_beats: int = 2
    """Signs of life, two seconds apart, that each worker of a newer release gives before it takes
    over."""
    confinement: Wanted = "auto"
    """Level at which workers are confined: `sandboxed` (bubblewrap), `restricted` (Landlock and
    filtered system calls), `none` (resource limits only); `auto`: the highest that the machine has.
    """
    minimum_confinement: Level = Level.RESTRICTED
    """Level below which this host does not start, where `auto` finds no better one; with `--user`
    it is `none`, and every status says so."""


@frozen
class PlanningSection:
    """How plans are searched for."""

    deadline_s: float = 10.0
    """Time that a search for a plan is given."""
    memory_mb: int = 512
    """Memory of a planner's process."""
    planners: tuple[str, ...] = ()
    """Names of the planners that search; with none, all that are installed do."""
    translate_s: float = 10.0
    """Time that components have to translate words which match no phrase."""
    establish_s: float = 30.0
    """Time that a lasting behaviour is given, from its start or its last sign of progress, until
    its effects hold; then it has failed."""
    finish_s: float = 600.0
    """Time that a finishing behaviour is given, from its start or its last sign of progress; then
    it has failed."""


@frozen
class PeersSection:
    """Other hosts: whether they are looked for, and what they may have of this one."""

    enabled: bool = True
    """Listen for other hosts, and look for them. With `--user` `false`, unless `--peer` is given,
    or the file sets `listen`, `static`, `development` or a router."""
    listen: tuple[str, ...] = ("tcp://*:7410",)
    """Where this host listens; port 0 picks one."""
    stream_port: int = 0
    """Where streams are fetched from this host; 0 picks a port each time."""
    discover: bool = True
    """Announce this host by multicast, and listen for others."""
    static: tuple[str, ...] = ()
    """Hosts to look for where multicast does not reach: `HOST` or `HOST:PORT`."""
    process: bool = False
    """Hold the links to other hosts in a separate process with a memory limit: what these hosts
    send cannot fill the daemon's memory then. Links by way of a router stay in the daemon."""
    development: bool = False
    """No keys: every host on this machine is a peer. Nothing leaves the machine; every status says
    so."""
    offer_actuators: tuple[str, ...] = ()
    """Components whose actuators peers may use; those of no other may move for a peer."""
    accept_goals: bool = True
    """Whether goals that a peer heard are taken. Where a router is named, `false` by default: no
    peer proves its key there."""
    place: bool = True
    """Whether payloads that do not fit here are offered to peers, and theirs are taken here. Where
    a router is named, `false` by default: no peer proves its key there."""


@frozen
class RouterSection:
    """A Zenoh router by which hosts reach each other, instead of links from each to each."""

    endpoints: tuple[str, ...] = ()
    """Where routers are, any of which will do: `tls/router.example:7447`. None: no router."""
    fleet: str = "nondum"
    """What tells fleets apart that share a router."""
    authorities: Path | None = None
    """Certificates (PEM) that the router's must come from."""
    certificate: Path | None = None
    """This host's (PEM), for a router that asks for one."""
    private_key: Path | None = None
    """Its key (PEM)."""


@frozen
class HostConfig:
    """All of it."""

    host: HostSection = field(default_factory=HostSection)
    drives: DrivesSection = field(default_factory=DrivesSection)
    trust: TrustSection = field(default_factory=TrustSection)
    devices: DevicesSection = field(default_factory=DevicesSection)
    install: InstallSection = field(default_factory=InstallSection)
    journal: JournalSection = field(default_factory=JournalSection)
    backups: BackupsSection = field(default_factory=BackupsSection)
    workers: WorkersSection = field(default_factory=WorkersSection)
    planning: PlanningSection = field(default_factory=PlanningSection)
    peers: PeersSection = field(default_factory=PeersSection)
    router: RouterSection = field(default_factory=RouterSection)
    feedback: FeedbackSection = field(default_factory=FeedbackSection)
    stop: StopSection = field(default_factory=StopSection)

    @property
    def first_trust_file(self) -> Path:
        """Where this host's trust begins."""
        return self.trust.file or self.host.state / "trust.toml"


def default_name(hostname: str) -> str:
    """A host name made of the machine's.

    >>> default_name("Spot_7.local")
    'spot-7'
    """
    name = re.sub(r"[^a-z0-9]+", "-", hostname.split(".")[0].lower()).strip("-")
    return name or "host"


def user_config() -> HostConfig:
    """The defaults of a host that a user runs without root: state and socket are the user's."""
    state = Path(control_sockets.user_state())
    return HostConfig(
        host=HostSection(state=state, control=Path(control_sockets.user_socket())),
        drives=DrivesSection(slots=(state / "slots",), block_devices=False),
        trust=TrustSection(file=None),
        devices=DevicesSection(slots=(state / "device-slots",)),
        peers=PeersSection(enabled=False),
        workers=WorkersSection(minimum_confinement=Level.NONE),
    )


def documented() -> Iterator[tuple[str, str, Any]]:
    """Section, key and default of every key, for the reference and its test."""
    for section in fields(HostConfig):
        kind = get_type_hints(HostConfig)[section.name]
        for key in fields(kind):
            yield section.name, key.name, None if key.default is MISSING else key.default
