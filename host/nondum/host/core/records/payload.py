"""Payloads that this host knows, its releases, and those that are gone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from nondum.host.core.records.moment import Moment
from nondum.host.core.records.step import Step
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class PayloadRecord:
    """A payload that this host knows of now: on a drive, or installed."""

    key: str
    digest: str
    payload_id: str
    version: str
    release: int
    fleet: str
    step: Step
    sources: Mapping[str, Path]
    """Drive → the payload's folder on it."""
    phases: Mapping[str, Moment]
    """`seen`, `verified`, `installed`, `ready` → when, as far as it has come."""
    components: tuple[str, ...] = ()
    """By their names on this host; empty until it was verified."""
    renamed: Mapping[str, str] = field(default_factory=dict)
    """Id in its manifest → name on this host, of those components where that is another."""
    problems: tuple[Problem, ...] = ()
    was: int = 0
    """The release that it took over from when it last became active; 0: none."""

    @property
    def drives(self) -> tuple[str, ...]:
        """Where it is, by name."""
        return tuple(sorted(self.sources))

    @property
    def names(self) -> dict[str, str]:
        """Id in its manifest → name on this host, of each component."""
        ids = {name: id for id, name in self.renamed.items()}
        return {ids.get(name, name): name for name in self.components}


@frozen
class Rollback:
    """A person wants an earlier release of a payload to be active."""

    digest: str
    """The release that is to be."""
    release: int
    below: int
    """The newest release that it goes before; a newer one counts again."""


@frozen
class FormerPayload:
    """A payload that was active here and is gone: what it could do, so that it can be named when
    something is missing. Nothing of it runs, and none of its files are kept by this."""

    payload_id: str
    version: str
    components: Mapping[str, PluginDescription]
    """Id → what the component said of itself."""
    left_wall_s: float
    """When it was withdrawn, in seconds since 1970; if that was while no daemon ran, when the next
    one started."""
    size: int
    """Length of `components` as JSON."""
    host: str = ""
    """The peer whose payload it was; empty: this host's."""

    @property
    def key(self) -> str:
        """One memory for each."""
        return f"{self.payload_id}@{self.host}" if self.host else self.payload_id
