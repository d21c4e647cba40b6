"""The hooks that an extension of the host may implement (docs/hooks.md).

An extension is a module or object named by an entry point of the group `nondum.host`, in the
environment of the daemon: it runs in the daemon's process and is trusted, and must not block.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias

import pluggy

from nondum.host.config.host_config import HostConfig
from nondum.host.core.events.event import Emit
from nondum.host.core.feedback_state import StateReason
from nondum.host.core.records.snapshot import Snapshot
from nondum.sdk.frozen import frozen

if TYPE_CHECKING:  # a host without peers loads none of it
    from nondum.transport.fleet import Find, Fleet, FleetEvent
    from nondum.transport.peers import Handler, Identity, Trust

PROJECT = "nondum.host"
"""The name of pluggy's project, and of the group of entry points."""
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)
HOOKS = ("planners", "feedback_outputs", "listeners", "fleets", "config_keys")


class Output(Protocol):
    """A way to show a state to a person."""

    async def show(self, reason: StateReason) -> None:
        """Show it. Raises `NondumError` where that cannot be done."""
        ...

    async def end(self) -> None:
        """Leave everything as it was before."""
        ...


class Say(Protocol):
    """Has a sentence said by the components that speak."""

    async def __call__(self, text: str) -> None:
        """Return once it is said, or after a while."""
        ...


@frozen
class Host:
    """What an extension may know and use of the host that it runs in."""

    config: HostConfig
    """The configuration, as it was read."""
    folder: Path
    """The state folder; an extension keeps files in `extensions/<its name>/` below it."""
    snapshot: Callable[[], Snapshot]
    """The catalogue as it was last committed."""
    say: Say
    """Has a sentence said by the components that speak."""
    told: Callable[[], Sequence[str]]
    """The newest sentences that people were told, the newest last."""


@frozen
class FleetMember:
    """What this host brings into a fleet."""

    identity: Identity
    """Its name and keys."""
    trust: Trust
    """Which hosts are let in, to begin with."""
    handler: Handler
    """Answers what peers call."""
    on_event: Callable[[FleetEvent], None]
    """Called when a peer comes, changes or goes."""
    find: Find
    """Looks for hosts, where these are linked one by one."""


MakeFleet: TypeAlias = Callable[[FleetMember], "Fleet"]
"""Makes the fleet, not started yet, on the running loop. Raises `PeerRefused`."""


@hookspec
def planners() -> Mapping[str, str]:  # type: ignore[empty-body]  # specifications have no body
    """Planners by name: `module:Class`, each runs in a separate process.

    The class has the interface `nondum.sdk.planner.Planner` or `TextPlanner`.
    """


@hookspec
def feedback_outputs(host: Host) -> Iterable[Output]:  # type: ignore[empty-body]  # a specification
    """What shows people the host's state: lamps, sounds, displays."""


@hookspec
def listeners(host: Host) -> Iterable[Emit]:  # type: ignore[empty-body]  # a specification
    """Functions that are told every event, on the loop: one that changes the catalogue once that is
    committed or, for progress within a plug, held for the next commit."""


@hookspec
def fleets(config: HostConfig) -> Mapping[str, MakeFleet]:  # type: ignore[empty-body]  # a specification
    """The ways to reach other hosts that the configuration asks for, by name.

    Each is a function that makes a `nondum.transport.fleet.Fleet` for a `member`, not started yet.
    All extensions together must have exactly one (FLEET_AMBIGUOUS, ZENOH_MISSING); where it raises
    `PeerRefused`, the host does not start. Asked only on hosts that have peers.
    """


@hookspec
def config_keys() -> Iterable[str]:  # type: ignore[empty-body]  # a specification
    """Keys of the configuration that the extension acts on, such as `feedback.lamps`.

    Where a key is set that needs an extension, and no extension acts on it, every status warns of
    it (`EXTENSION_MISSING`).
    """
