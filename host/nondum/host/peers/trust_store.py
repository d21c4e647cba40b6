"""Stores the identity that this host has for its peers, and its trust, in `<state>/peers/`.

    host.key      its own key pair, made at the first start; no other user may read it
    trust.json    fleets, paired hosts and revoked keys
    certificate   what a fleet has signed for it, if one has

What a host is let in by takes effect once it is on disk; what it is kept out by, at once.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from nondum.sdk.errors import Problem
from nondum.transport.peers import certificate as certificates
from nondum.transport.peers import private_file, trust_file
from nondum.transport.peers.certificate import Certificate
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.identity import Identity
from nondum.transport.peers.keys import HostKeys, PeerKey, fingerprint, load_or_create
from nondum.transport.peers.public_file import FleetPublic, HostPublic
from nondum.transport.peers.trust import Trust

KEY_NAME, TRUST_NAME, CERTIFICATE_NAME = "host.key", "trust.json", "certificate"


class PeerTrustStore:
    """A host's keys, certificate and trust. Its methods run on the loop, the disk does not."""

    def __init__(
        self,
        folder: Path,
        host: HostPublic,
        keys: HostKeys,
        trust: Trust,
        *,
        on_change: Callable[[Trust], None],
        on_certificate: Callable[[bytes], None],
        clock: Callable[[], datetime],
    ) -> None:
        """Use `open`."""
        self.folder, self.host, self.trust = folder, host, trust
        self.certificate: Certificate | None = None
        """What a fleet has signed for this host; that fleet need not be one it trusts."""
        self.warnings: tuple[Problem, ...] = ()
        """What is wrong with the files, and does not keep the host from running."""
        self._keys, self._on_change, self._on_certificate = keys, on_change, on_certificate
        self._clock = clock
        self._saving = asyncio.Lock()

    @classmethod
    async def open(
        cls,
        folder: Path,
        name: str,
        *,
        on_change: Callable[[Trust], None] = lambda _: None,
        on_certificate: Callable[[bytes], None] = lambda _: None,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> PeerTrustStore:
        """Read the files of the host `name` in `<state>/peers`, and make a key at the first start.

        `on_change` is told of every new trust, `on_certificate` of a certificate to show from now
        on. Raises `PeerRefused` (FILE_OPEN_TO_OTHERS, FILE_MALFORMED, KEY_MALFORMED,
        PEERS_FOLDER).
        """
        try:
            keys, trust = await asyncio.to_thread(_load, folder)
            certificate = await asyncio.to_thread(_read_certificate, folder / CERTIFICATE_NAME)
        except OSError as error:
            raise PeerRefused(_disk(folder, error)) from error
        trust_store = cls(
            folder,
            HostPublic(keys.public, name),
            keys,
            trust,
            on_change=on_change,
            on_certificate=on_certificate,
            clock=clock,
        )
        trust_store._show_kept(certificate)
        return trust_store

    @property
    def key(self) -> PeerKey:
        """This host's public key."""
        return self.host.key

    def identity(self, *, development: bool = False) -> Identity:
        """Who this host is, for a `PeerNode`; in development mode, a host without keys."""
        if development:
            return Identity(self.host.name, None)
        shown = self.certificate.to_bytes() if self.certificate else b""
        return Identity(self.host.name, self._keys, shown)

    async def pair(self, key: PeerKey, name: str) -> None:
        """Let in a host. Raises `PeerRefused` (KEY_REVOKED, PEERS_FOLDER)."""
        await self._extend(lambda trust: trust.with_paired(key, name))

    async def trust_fleet(self, fleet: FleetPublic) -> None:
        """Let in the hosts that a fleet certifies. Raises `PeerRefused` (PEERS_FOLDER)."""
        await self._extend(lambda trust: trust.with_fleet(fleet.key, fleet.name))

    async def revoke(self, key: PeerKey, why: str) -> None:
        """Never let in a key again; a peer that is here under it is cut now.

        Raises `PeerRefused` (KEY_OWN, PEERS_FOLDER); with the latter, it holds until the host is
        restarted.
        """
        if key == self.key:
            told = "this is the host's own key"
            fix = "revoke it on the other hosts, and delete the file to have a new one made"
            where = str(self.folder / KEY_NAME)
            raise PeerRefused(Problem("KEY_OWN", told, where=where, fix=fix))
        await self._restrict(lambda trust: trust.with_revoked(key, why))

    async def forget(self, key: str) -> None:
        """Forget a paired host or a fleet (who is here by it is cut), or that a key was revoked.

        Raises `PeerRefused` (PEERS_FOLDER).
        """
        await self._restrict(lambda trust: trust.without(key))

    async def certify(self, data: bytes) -> Certificate:
        """Show peers this certificate from now on: a person gave it.

        Other hosts let this host in by it; this host lets no host in by it, so it need not trust
        the fleet that signed it. Raises `PeerRefused` (CERTIFICATE_…, PEERS_FOLDER).
        """
        found = certificates.parse(data)
        self._check(found)
        await self._save(CERTIFICATE_NAME, found.to_bytes().decode("ascii"))
        self.certificate = found
        self._on_certificate(found.to_bytes())
        return found

    async def offer(self, data: bytes) -> Certificate | None:
        """Take a certificate that lay on a drive, where it is this host's and of use; else None.

        A drive proves nothing: it must not replace a certificate that peers accept by a
        stranger's. So its certificate is taken only where no valid one is held, or if it is of
        the same fleet and valid for longer. Raises `PeerRefused` (PEERS_FOLDER).
        """
        try:
            found = certificates.parse(data)
            self._check(found)
        except PeerRefused:
            return None
        if not self._is_better(found):
            return None
        return await self.certify(data)

    def _check(self, found: Certificate) -> None:
        """Raises `PeerRefused` (CERTIFICATE_…)."""
        if found.key != self.key:
            raise PeerRefused(
                Problem(
                    "CERTIFICATE_KEY",
                    "the certificate is another host's: its key is not this one's",
                    where=found.host,
                    need=fingerprint(self.key),
                    have=fingerprint(found.key),
                    fix="have one signed for what `nondum peers key` prints",
                )
            )
        if found.host != self.host.name:
            raise PeerRefused(
                Problem(
                    "CERTIFICATE_NAME",
                    "the certificate calls this host by another name",
                    need=self.host.name,
                    have=found.host,
                    fix="have it signed again, or change `name` under [host]",
                )
            )
        certificates.verify(found, {found.fleet}, self._clock())

    def _is_better(self, found: Certificate) -> bool:
        """Whether the certificate of a drive is to replace the one that is held."""
        held = self.certificate
        if held is None:
            return True
        try:
            self._check(held)
        except PeerRefused:
            return True
        return found.fleet == held.fleet and found.not_after > held.not_after

    def _show_kept(self, data: bytes) -> None:
        """Show the certificate that is kept, unless it is of no use: then warn."""
        if not data:
            return
        try:
            found = certificates.parse(data)
            self._check(found)
        except PeerRefused as refused:
            self.warnings += refused.problems
            if refused.code != "CERTIFICATE_TIME":  # a clock may be set yet
                return
        self.certificate = found

    async def _extend(self, change: Callable[[Trust], Trust]) -> None:
        async with self._saving:
            await self._save(TRUST_NAME, trust_file.to_text(change(self.trust)))
            self._take(change(self.trust))  # once more: a key may have been revoked meanwhile

    async def _restrict(self, change: Callable[[Trust], Trust]) -> None:
        self._take(change(self.trust))
        async with self._saving:
            await self._save(TRUST_NAME, trust_file.to_text(self.trust))

    def _take(self, trust: Trust) -> None:
        self.trust = trust
        self._on_change(trust)

    async def _save(self, name: str, text: str) -> None:
        writing = asyncio.ensure_future(
            asyncio.to_thread(private_file.replace, self.folder / name, text)
        )
        try:
            await asyncio.shield(writing)
        except OSError as error:
            raise PeerRefused(_disk(self.folder / name, error)) from error
        finally:  # a caller that left must not have two threads write one file
            await asyncio.wait({writing})


def _load(folder: Path) -> tuple[HostKeys, Trust]:
    return load_or_create(folder / KEY_NAME), trust_file.load(folder / TRUST_NAME)


def _read_certificate(path: Path) -> bytes:
    return private_file.read_own(path).encode("utf-8") if path.exists() else b""


def _disk(path: Path, error: OSError) -> Problem:
    return Problem(
        "PEERS_FOLDER",
        f"who is trusted cannot be kept there: {error.strerror or error}",
        where=str(error.filename or path),
        fix="look at the disk, and at `state` under [host]",
    )
