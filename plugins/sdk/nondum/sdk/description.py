"""What a plugin says about itself: the values of the describing hooks.

The same values stand in a payload's `index.json`, travel as a worker's answer to `describe`, and
are what the host plans with. They are plain data: `PluginDescription.to_dict` and `parse` are
inverse to each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from importlib import resources
from typing import Any, cast

from nondum.sdk.codec.checks import Mismatch
from nondum.sdk.codec.values import OMIT_DEFAULT, from_plain, to_plain
from nondum.sdk.errors import Problem, WorkerFailed
from nondum.sdk.frozen import frozen

ACTUATORS = frozenset({"base", "pointer", "arm", "gripper"})
"""Unit types that move the body: one user at a time, whatever their plugin says."""


WHEN_LOST = ("stop", "hold", "finish")
"""`stop`: it is halted at once. `hold`: it goes on until a person halts it, or the same host asks
for it again. `finish`: it goes on to its end; a lasting behaviour has none, so it is held."""


_ADDED = OMIT_DEFAULT
"""Of keys that were added after others had been released: hosts of before refuse what they do not
know, so such a key is written only where an author has said something in it."""


@frozen
class Fragment:
    """A piece of PDDL, a domain or a problem, that a component contributes.

    In it the local names stand for the plugin's units and outputs, and `self` stands for the host;
    the host puts the full object names in their place.
    """

    name: str
    """File name, for messages: `domain.pddl`."""
    text: str

    @classmethod
    def from_package(cls, package: str, name: str) -> Fragment:
        """Read a fragment that is packaged beside the plugin's code."""
        text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
        return cls(name=name, text=text)


@frozen
class Output:
    """An output slot of a unit: one stream object in planning."""

    name: str
    type: str
    """A stream type: image, depth, points, detections, twist, pose, audio, text, scalar …"""
    always: bool = False
    """Produced from `start` on, not by a behaviour."""
    of: str = field(default="", metadata=_ADDED)
    """The type of unit that the stream tells of, where it is not the unit that sends it: `base` for
    odometry that a camera works out."""


@frozen
class Input:
    """An optional input of a unit, wired by the host to a flowing stream on the same body that has
    its type and is of what it asks for. (Required inputs are the stream parameters of actions.)"""

    name: str
    type: str
    of: str = field(default="", metadata=_ADDED)
    """The type of unit that the stream must tell of: `base` for the odometry of this body's base.
    Empty: of anything; then a stream that only has the type may be the wrong one."""


@frozen
class Unit:
    """What a component brings to act with: the actor of its actions."""

    name: str
    """Local name; the object is `<host>__<component>__<name>`."""
    type: str
    outputs: tuple[Output, ...] = ()
    inputs: tuple[Input, ...] = ()
    users: int = 0
    """How many behaviours it serves at once; 0: no limit. Actuators always serve one."""


@frozen
class Behaviour:
    """Something that a plugin can do, startable and haltable."""

    name: str
    action: str
    """`(action ?actor - type ?other - type …)`: the signature of the action that it carries out."""
    lasting: bool = False
    """False: finishing. True: its effects hold while it runs."""
    phrases: tuple[str, ...] = ()
    doc: str = ""
    when_lost: str = "stop"
    """What becomes of it when another host asked for it and is lost: one of `WHEN_LOST`."""


@frozen
class Condition:
    """Something that a plugin can tell about the world: it keeps predicates true or false."""

    name: str
    predicates: tuple[str, ...]
    doc: str = ""


@frozen
class Phrase:
    """A pattern of words and the goal that it asks for."""

    pattern: str
    """`point at {t:target}`; `[…]` is optional; `{words:text}` takes free words, binds nothing."""
    goal: str
    """PDDL over the slots: `(pointing self ?t)`."""
    kind: str = "achieve"
    """`achieve`, `maintain`, or `do`: achieve it again each time, as the answer to a question."""


@frozen
class Label:
    """A name in words for an object or class: `("radiation-source", "the radiation source")`."""

    object: str
    words: str


@frozen
class DeviceNeed:
    """A device that a plugin opens, matched on udev properties."""

    name: str
    match: Mapping[str, str]
    """udev property → value or shell pattern; all must match."""
    optional: bool = False


@frozen
class PluginDescription:
    """All that a plugin says about itself."""

    name: str
    """The distribution's normalised name."""
    version: str
    summary: str = ""
    behaviours: tuple[Behaviour, ...] = ()
    conditions: tuple[Condition, ...] = ()
    fragments: tuple[Fragment, ...] = ()
    units: tuple[Unit, ...] = ()
    devices: tuple[DeviceNeed, ...] = ()
    phrases: tuple[Phrase, ...] = ()
    labels: tuple[Label, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON and msgpack, lists for tuples."""
        return cast(dict[str, Any], to_plain(self))

    @classmethod
    def parse(cls, data: object, *, where: str) -> PluginDescription:
        """Check plain data from outside and make the value of it.

        Raises `WorkerFailed` (DESCRIPTION_INVALID) that names the place in `where`.
        """
        try:
            return from_plain(cls, data, where)
        except Mismatch as mismatch:
            fix = "build the payload again with the SDK that the host knows"
            raise WorkerFailed(
                Problem("DESCRIPTION_INVALID", mismatch.reason, where=mismatch.place, fix=fix)
            ) from None
