"""Has a mesh look for hosts: its announcements and its hints, by multicast and static hosts."""

from __future__ import annotations

import asyncio
import dataclasses

from nondum.host.config.host_config import PeersSection
from nondum.sdk.errors import Problem
from nondum.transport.discovery import Announcement, Discovery, DiscoveryStatus, Hint
from nondum.transport.fleet import Mesh
from nondum.transport.peers import PeerRefused

PAIRING_LOOK_S = 1.0
"""Between two looks at static hosts while one is to be paired with."""


class PeerFinder:
    """A mesh's `Finder`."""

    def __init__(self, mesh: Mesh, config: PeersSection) -> None:
        """Made once the mesh listens."""
        self._mesh = mesh
        self._looking: asyncio.TimerHandle | None = None
        self._announcement = Announcement(mesh.key, mesh.name, mesh.epoch, mesh.addresses)
        self._discovery = Discovery(
            self._announcement,
            on_hint=self._on_hint,
            on_gone=mesh.no_more_hints,
            static=config.static,
            multicast=config.discover,
            prefers=mesh.is_welcome,
        )

    async def start(self) -> None:
        """Begin to look."""
        await self._discovery.start()

    async def close(self) -> None:
        """Look no more."""
        self._stop_looking()
        await self._discovery.close()

    @property
    def status(self) -> DiscoveryStatus:
        """What was announced and heard."""
        return self._discovery.status()

    @property
    def identity_problem(self) -> Problem | None:
        """What a person must know of another host under this one's key or name."""
        return self._discovery.identity_problem

    @property
    def hints(self) -> tuple[Hint, ...]:
        """Who may be where."""
        return tuple(self._discovery.hints.values())

    def announce_pairing(self, port: int | None) -> None:
        """Tell where this host can be asked to pair, or that it cannot any more."""
        self._announcement = dataclasses.replace(self._announcement, pairing_port=port)
        self._discovery.announce(self._announcement)
        self._stop_looking()
        if port is not None:
            self._look_again()

    def tell_again(self) -> None:
        """Tell the mesh of all hints again: it may let in others now."""
        for hint in self.hints:
            self._on_hint(hint)

    def _look_again(self) -> None:
        """Look again, and again later: the host to pair with may not have opened its window yet."""
        self._discovery.look_again()
        loop = asyncio.get_running_loop()
        self._looking = loop.call_later(PAIRING_LOOK_S, self._look_again)

    def _stop_looking(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None

    def _on_hint(self, hint: Hint) -> None:
        try:
            self._mesh.meet(hint.key, hint.addresses, hint.epoch)
        except PeerRefused:  # in development mode, hints lead beyond this machine, too
            local = [one for one in hint.addresses if self._is_usable(one)]
            if local:
                self._mesh.meet(hint.key, local, hint.epoch)

    def _is_usable(self, address: str) -> bool:
        try:
            self._mesh.check_address(address)
        except PeerRefused:
            return False
        return True
