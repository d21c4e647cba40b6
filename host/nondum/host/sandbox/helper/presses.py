"""Presses of the stop key, read by the helper or by the daemon itself."""

from __future__ import annotations

from typing import Protocol


class Presses(Protocol):
    """Presses of one key, as they come."""

    is_down_at_first: bool
    """Whether it was held down when the listening began."""

    def fileno(self) -> int:
        """To wait for."""
        ...

    def read(self) -> int:
        """How many presses have come. Raises `OSError` when there will be no more."""
        ...

    def close(self) -> None:
        """Listen no more."""
        ...
