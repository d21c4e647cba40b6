"""Data are shown to components, and taken away."""

from __future__ import annotations

from nondum.host.core.events.event import Event
from nondum.sdk.frozen import frozen


@frozen
class DataShown(Event):
    """A component is shown data that it asks for."""

    data: str
    """Id of a `DataRecord`."""
    component: str
    need: str


@frozen
class DataWithdrawn(Event):
    """A component is shown data no more."""

    data: str
    component: str
    need: str
