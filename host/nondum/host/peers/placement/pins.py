"""Which payload a person wants on which host, kept in `<state>/places.json`."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Mapping
from pathlib import Path

from nondum.sdk.errors import InstallFailed, Problem
from nondum.transport.peers import private_file

log = logging.getLogger(__name__)


class Pins:
    """Payload id → host. `await open(…)` it."""

    def __init__(self, path: Path, kept: Mapping[str, str]) -> None:
        """Use `open`."""
        self._path, self.hosts = path, dict(kept)
        self._writing = asyncio.Lock()

    @classmethod
    async def open(cls, path: Path) -> Pins:
        """Read what is kept; a file that cannot be read is as good as none."""
        return cls(path, await asyncio.to_thread(_read, path))

    async def put(self, payload_id: str, host: str) -> None:
        """Keep where a payload is to run. Raises `InstallFailed` (IO_ERROR)."""
        async with self._writing:
            await self._write({**self.hosts, payload_id: host})

    async def drop(self, payload_id: str) -> None:
        """Let a payload run anywhere again. Raises `InstallFailed` (IO_ERROR)."""
        async with self._writing:
            await self._write({id: host for id, host in self.hosts.items() if id != payload_id})

    async def _write(self, hosts: dict[str, str]) -> None:
        text = json.dumps(hosts, indent=2, sort_keys=True) + "\n"
        try:
            await asyncio.to_thread(private_file.replace, self._path, text)
        except OSError as error:
            told = f"where payloads are to run cannot be kept: {error.strerror}"
            raise InstallFailed(Problem("IO_ERROR", told, where=str(self._path))) from error
        self.hosts = hosts


def _read(path: Path) -> dict[str, str]:
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        log.warning("%s cannot be read, so no payload is pinned to a host: %s", path, error)
        return {}
    pairs = said.items() if isinstance(said, dict) else ()
    return {id: host for id, host in pairs if isinstance(host, str)}
