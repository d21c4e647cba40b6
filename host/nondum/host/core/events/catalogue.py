"""The catalogue has a new revision, or its file cannot be read or written."""

from __future__ import annotations

from typing import ClassVar

from nondum.host.core.events.event import Event
from nondum.sdk.errors import Problem
from nondum.sdk.frozen import frozen


@frozen
class Recomposed(Event):
    """The catalogue has a new revision: components came, went or changed."""

    revision: int
    reason: str


@frozen
class CatalogueSetAside(Event):
    """The catalogue's file was damaged or gone: a backup, or a new one, took its place."""

    host: str
    problems: tuple[Problem, ...]


@frozen
class CatalogueUnwritten(Event):
    """What happens is not on disk: the host goes on, and writes it as soon as it can."""

    JOURNALLED: ClassVar[bool] = False

    host: str
    problems: tuple[Problem, ...]


@frozen
class CatalogueWritten(Event):
    """All that happened is on disk again."""

    host: str
