"""What a plugin says about itself: the values of the describing hooks.

The same values stand in a payload's `index.json`, travel as a worker's answer to `describe`, and
are what the host plans with. They are plain data: `PluginDescription.to_dict` and `parse` are
inverse to each other.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from nondum.sdk.errors import Problem, WorkerFailed

ACTUATORS = frozenset({"base", "pointer", "arm", "gripper"})
"""Unit types that move the body: one user at a time, whatever their plugin says."""


WHEN_LOST = ("stop", "hold", "finish")
"""`stop`: it is halted at once. `hold`: it goes on until a person halts it, or the same host asks
for it again. `finish`: it goes on to its end; a lasting behaviour has none, so it is held."""


_ADDED = {"added": True}
"""Of keys that were added after others had been released: hosts of before refuse what they do not
know, so such a key is written only where an author has said something in it."""


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Input:
    """An optional input of a unit, wired by the host to a flowing stream on the same body that has
    its type and is of what it asks for. (Required inputs are the stream parameters of actions.)"""

    name: str
    type: str
    of: str = field(default="", metadata=_ADDED)
    """The type of unit that the stream must tell of: `base` for the odometry of this body's base.
    Empty: of anything; then a stream that only has the type may be the wrong one."""


@dataclass(frozen=True, slots=True)
class Unit:
    """What a component brings to act with: the actor of its actions."""

    name: str
    """Local name; the object is `<host>__<component>__<name>`."""
    type: str
    outputs: tuple[Output, ...] = ()
    inputs: tuple[Input, ...] = ()
    users: int = 0
    """How many behaviours it serves at once; 0: no limit. Actuators always serve one."""


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Condition:
    """Something that a plugin can tell about the world: it keeps predicates true or false."""

    name: str
    predicates: tuple[str, ...]
    doc: str = ""


@dataclass(frozen=True, slots=True)
class Phrase:
    """A pattern of words and the goal that it asks for."""

    pattern: str
    """`point at {t:target}`; `[…]` is optional; `{words:text}` takes free words, binds nothing."""
    goal: str
    """PDDL over the slots: `(pointing self ?t)`."""
    kind: str = "achieve"
    """`achieve`, `maintain`, or `do`: achieve it again each time, as the answer to a question."""


@dataclass(frozen=True, slots=True)
class Label:
    """A name in words for an object or class: `("radiation-source", "the radiation source")`."""

    object: str
    words: str


@dataclass(frozen=True, slots=True)
class DeviceNeed:
    """A device that a plugin opens, matched on udev properties."""

    name: str
    match: Mapping[str, str]
    """udev property → value or shell pattern; all must match."""
    optional: bool = False


@dataclass(frozen=True, slots=True)
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
        return _plain(self)  # type: ignore[no-any-return]  # a dataclass always gives a dict

    @classmethod
    def parse(cls, data: object, *, where: str) -> PluginDescription:
        """Check plain data from outside and make the value of it.

        Raises `WorkerFailed` (DESCRIPTION_INVALID) that names the place in `where`.
        """
        return _parse(cls, data, where)


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        said = ((key, getattr(value, key.name)) for key in dataclasses.fields(value))
        return {
            key.name: _plain(one)
            for key, one in said
            if "added" not in key.metadata or one != key.default
        }
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return dict(value)
    return value


_T = TypeVar("_T")


def _parse(cls: type[_T], data: object, where: str) -> _T:
    if not isinstance(data, Mapping):
        raise _invalid(where, f"expected a table for {cls.__name__}, found {type(data).__name__}")
    hints = get_type_hints(cls)
    unknown = sorted(str(key) for key in data if key not in hints)
    if unknown:
        raise _invalid(where, f"unknown key {unknown[0]!r}; known: {', '.join(sorted(hints))}")
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]  # only called with dataclasses
    missing = [f.name for f in fields if f.default is dataclasses.MISSING and f.name not in data]
    if missing:
        raise _invalid(where, f"key {missing[0]!r} is missing")
    return cls(**{k: _value(hints[k], v, f"{where}.{k}") for k, v in data.items()})


def _value(hint: Any, data: object, where: str) -> Any:
    origin = get_origin(hint)
    if origin is tuple:
        if not isinstance(data, list | tuple):
            raise _invalid(where, f"expected a list, found {type(data).__name__}")
        item = get_args(hint)[0]
        return tuple(_value(item, value, f"{where}[{i}]") for i, value in enumerate(data))
    if origin is not None:  # Mapping[str, str]
        if not isinstance(data, Mapping) or not all(
            isinstance(k, str) and isinstance(v, str) for k, v in data.items()
        ):
            raise _invalid(where, "expected a table of strings")
        return dict(data)
    if dataclasses.is_dataclass(hint):
        return _parse(hint, data, where)  # type: ignore[arg-type]  # is_dataclass also admits instances
    if type(data) is not hint:
        raise _invalid(where, f"expected {hint.__name__}, found {type(data).__name__}")
    return data


def _invalid(where: str, message: str) -> WorkerFailed:
    return WorkerFailed(
        Problem(
            "DESCRIPTION_INVALID",
            message,
            where=where,
            fix="build the payload again with the SDK that the host knows",
        )
    )
