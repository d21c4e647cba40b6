"""A fleet for one demonstration: hosts that it certifies accept each other and no other host."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from nondum.transport.peers import fleet_files, trust_file
from nondum.transport.peers.keys import load_or_create
from nondum.transport.peers.public_file import HostPublic
from nondum.transport.peers.trust import Trust

NAME = "demonstration"


class Fleet:
    """Its secret key, and what it is called."""

    def __init__(self, folder: Path) -> None:
        """Make its keys in a new folder."""
        self._folder = folder
        folder.mkdir()
        self._public = fleet_files.create(folder, NAME)

    def admit(self, name: str, state: Path) -> None:
        """Give a host that has not been started yet its key, a certificate, and this fleet to
        trust: what its owner does on the day it is bought."""
        folder = state / "peers"
        keys = load_or_create(folder / "host.key")
        host = HostPublic(keys.public, name)
        certificate = fleet_files.sign(self._folder, host, now=datetime.now(UTC), days=1)
        (folder / "certificate").write_bytes(certificate.to_bytes())
        trust_file.save(folder / "trust.json", Trust().with_fleet(self._public.key, NAME))
