"""What a goal lacks, as data: programs go by this, people read the problem that says the same."""

from __future__ import annotations

from typing import Any, cast

from nondum.sdk.codec.values import to_plain
from nondum.sdk.frozen import frozen


@frozen
class Need:
    """One thing that is missing for a goal."""

    code: str
    """Of the problem that tells it."""
    said: str
    """What is missing in one clause, without what needs it."""
    fact: str = ""
    """The condition that does not hold, if it is one; `?type` stands for what is not determined."""
    types: tuple[str, ...] = ()
    """What there is nothing of, if it is a thing: one of these types would do."""
    waits: bool = False
    """For the device of a component that is well: the component is said to wait for it."""

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return cast(dict[str, Any], to_plain(self))
