"""What all events have in common, and the function that passes them on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, TypeAlias, cast

from nondum.sdk.codec.values import to_plain
from nondum.sdk.frozen import frozen


@frozen
class Event:
    """Anything that has happened."""

    JOURNALLED: ClassVar[bool] = True
    """Whether the journal keeps it."""

    @property
    def name(self) -> str:
        """The event's name as the journal writes it: `DriveInserted`."""
        return type(self).__name__

    def to_dict(self) -> dict[str, Any]:
        """Plain data for the journal and for people's tools."""
        return cast(dict[str, Any], to_plain(self))


Emit: TypeAlias = Callable[[Event], None]
"""Passes an event on; never blocks, called on the loop's thread."""
