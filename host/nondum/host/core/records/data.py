"""Data that active payloads bring, and which component is shown which."""

from __future__ import annotations

from pathlib import Path

from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.data import DataNeed


@frozen
class DataRecord:
    """Data that are on this host as long as their payload is active."""

    payload: str
    """Key of the payload that brings them."""
    payload_id: str
    """Given as they are entered."""
    name: str
    kind: str
    version: str
    """PEP 440."""
    folder: Path
    files: tuple[str, ...]
    """Paths below the folder, as their payload lists them."""
    size: int
    """Bytes of all files."""

    @property
    def id(self) -> str:
        """Tells them apart from all others on this host."""
        return f"{self.payload}/{self.name}"


@frozen
class DataClaim:
    """Data that a component asks for, and those that it is shown."""

    need: DataNeed
    data: str | None = None
    """Id of a `DataRecord`; None: there are none that would do."""
