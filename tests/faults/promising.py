"""Makes each promise that a host's disk must keep, and says so: `FOLDER` (see `traced_disk`).

Runs as a program under strace(1). What it writes it has the host's own code write.
"""

from __future__ import annotations

import asyncio
import shutil
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from tests.faults.traced_disk import Kind, promise
from tests.kit.lamp_drive import lamp, told
from tests.kit.payloads import sha256
from tests.kit.signing import Key, signed, trust_of

from nondum.host.catalogue import opening
from nondum.host.catalogue.backups import Backups
from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.core.records.safety import Safety
from nondum.host.jobs import install as install_job
from nondum.host.lifecycle import rebuilding
from nondum.host.manager import installation, state_folders
from nondum.host.manager.crash_loop import CrashCounter
from nondum.host.manager.state_folders import Folders
from nondum.host.peers.placement.pins import Pins
from nondum.host.peers.trust_store import CERTIFICATE_NAME, KEY_NAME, TRUST_NAME, PeerTrustStore
from nondum.host.trust import anchors, chain
from nondum.transport.peers import HostKeys, fleet_files
from nondum.transport.peers.certificate import issue, new_fleet
from nondum.wheelhouse.build import data_payload
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import MANIFEST
from nondum.wheelhouse.trust import owners_folder, trust_text

ROOT_KEY = Key("root")
TRUST = trust_of(roots=[ROOT_KEY])


def main(folder: Path, elsewhere: Path) -> None:
    """`elsewhere` is for what no promise is made of."""
    folders = Folders(folder / "state")
    asyncio.run(keep_catalogue(folders))
    lose_catalogue(folders)
    begin_to_trust(folder / "etc/nondum/trust.toml")
    follow_trust(folders)
    asyncio.run(keep_peers(folders))
    install(folders, elsewhere)
    count(folders)
    own(folder / "owner", elsewhere)


async def keep_catalogue(folders: Folders) -> None:
    """Commits, and copies of the file."""
    catalogue = await Catalogue.open(folders.catalogue, "spot")
    promise(Kind.SAFE, folders.catalogue)
    for revision in (1, 2):
        await catalogue.commit(replace(catalogue.state, revision=revision), ())
        promise(Kind.SAFE, folders.catalogue)
        promise(Kind.SAFE, folders.catalogue.with_name("catalogue.sqlite-wal"))
        catalogue.backups.make()
        promise(Kind.WHOLE, catalogue.backups.newest)
    promise(Kind.WHOLE, catalogue.backups.before)
    await catalogue.close()


def lose_catalogue(folders: Folders) -> None:
    """A damaged one is set aside, a copy takes its place."""
    aside = opening.set_aside(folders.catalogue)
    assert aside is not None
    promise(Kind.SAFE, aside)
    promise(Kind.GONE, folders.catalogue)
    Backups(folders.catalogue).restore(Backups(folders.catalogue).newest)
    promise(Kind.SAFE, folders.catalogue)


def begin_to_trust(file: Path) -> None:
    """The first trust file, as the command of a person writes it."""
    anchors.place(file, signed(TRUST, ROOT_KEY))
    signature = file.with_name(f"{file.name}.sig")
    promise(Kind.WHOLE, file)
    promise(Kind.WHOLE, signature)
    promise(Kind.FIRST, signature, file)


def follow_trust(folders: Folders) -> None:
    """The next version of a trust file."""
    following = signed(replace(TRUST, version=2), ROOT_KEY)
    known = [signed(TRUST, ROOT_KEY).digest]
    given = {"folder": str(folders.trust), "known": known, "trust": trust_text.to_text(TRUST)}
    said = chain.extend({**given, "offered": chain.packed((following,))}, told)
    assert said["taken"] == [2]
    file = folders.trust / "00000002.toml"
    signature = file.with_name(f"{file.name}.sig")
    promise(Kind.WHOLE, file)
    promise(Kind.WHOLE, signature)
    promise(Kind.FIRST, signature, file)


async def keep_peers(folders: Folders) -> None:
    """This host's key and certificate, the hosts that it trusts or has revoked, and pins."""
    trust_store = await PeerTrustStore.open(folders.peers, "spot")
    promise(Kind.WHOLE, folders.peers / KEY_NAME)
    other = HostKeys.generate().public
    await trust_store.pair(other, "rover")
    promise(Kind.WHOLE, folders.peers / TRUST_NAME)
    await trust_store.revoke(other, "stolen")
    promise(Kind.WHOLE, folders.peers / TRUST_NAME)
    _, secret = new_fleet()
    begins, ends = datetime(2020, 1, 1, tzinfo=UTC), datetime(2220, 1, 1, tzinfo=UTC)
    certificate = issue(secret, "spot", trust_store.key, not_before=begins, not_after=ends)
    await trust_store.certify(certificate.to_bytes())
    promise(Kind.WHOLE, folders.peers / CERTIFICATE_NAME)
    pins = await Pins.open(folders.root / "places.json")
    await pins.put("org.example.lamp", "mule")
    promise(Kind.WHOLE, folders.root / "places.json")


def install(folders: Folders, elsewhere: Path) -> None:
    """Payloads are moved to where they stay and installed: by pip, and by links to what the store
    has already, so that the sync of new wheels makes up for no other."""
    _install(folders, elsewhere, "by-pip", "pip")
    store = Store(folders.store)
    promise(Kind.SAFE, folders.store)
    wheels = (lamp(elsewhere / "drive") / "wheels").iterdir()
    store.add_all([(wheel, sha256(wheel)) for wheel in wheels])
    for stored in store.listing():
        promise(Kind.WHOLE, stored.folder)
    _install(folders, elsewhere, "known", "store")
    _restore(folders, elsewhere, "restored")
    _install_data(folders, elsewhere, "data")
    first = store.listing()[0]
    store.compile(first.sha256)
    promise(Kind.SAFE, first.folder)
    promise(Kind.WHOLE, first.folder / MANIFEST)
    note = folders.note("known")
    rebuilding.write_note(note, "a", folders.payloads / "known")
    promise(Kind.WHOLE, note)


def _restore(folders: Folders, elsewhere: Path, key: str) -> None:
    staged = shutil.copytree(lamp(elsewhere / key / "drive"), folders.root / "staging" / key)
    shutil.rmtree(staged / "wheels")
    kept = folders.payloads / key
    state_folders.move(staged, kept)
    installation._sync(kept)
    promise(Kind.SAFE, kept)


def _install_data(folders: Folders, elsewhere: Path, key: str) -> None:
    file = elsewhere / "weights.gguf"
    file.write_bytes(b"weights")
    drive = elsewhere / key / "drive"
    made = data_payload.write(drive, "org.example.d", [file], name="weights", kind="gguf")
    _install_from(folders, elsewhere, key, "store", made)
    brought = folders.payloads / key / "data/weights"
    for path in (brought.parent, brought, brought / "weights.gguf", folders.root / "data"):
        promise(Kind.SAFE, path)
    promise(Kind.SAFE, folders.root / "data" / sha256(file))


def _install(folders: Folders, elsewhere: Path, key: str, method: str) -> None:
    _install_from(folders, elsewhere, key, method, lamp(elsewhere / key / "drive"))


def _install_from(folders: Folders, elsewhere: Path, key: str, method: str, payload: Path) -> None:
    staged = shutil.copytree(payload, folders.root / "staging" / key)
    kept = folders.payloads / key
    state_folders.move(staged, kept)
    arguments: dict[str, Any] = {
        "folder": str(kept),
        "venvs": str(elsewhere / "venvs" / key),
        "store": str(folders.store),
        "python": sys.executable,
        "method": method,
        "reserve_mb": 0,
        "confinement": 0,
        "allow_unsigned": True,
        "headroom": None,
    }
    install_job.install(arguments, told)
    promise(Kind.SAFE, kept)


def count(folders: Folders) -> None:
    """Daemons that died soon."""
    assert CrashCounter(folders.root).begin()[0] is Safety.OFF
    promise(Kind.WHOLE, folders.root / "deaths")


def own(folder: Path, elsewhere: Path) -> None:
    """What an owner keeps: a trust file with its versions, a fleet's key."""
    now = datetime(2026, 6, 1, tzinfo=UTC)
    path = folder / "trust.toml"
    owners_folder.create(path, TRUST)
    promise(Kind.WHOLE, path)
    owners_folder.sign(path, ROOT_KEY.write(elsewhere))
    promise(Kind.WHOLE, path.with_name("trust.toml.sig"))
    owners_folder.edit(path, lambda trust: replace(trust, fleets=("survey",)), now)
    promise(Kind.WHOLE, path)
    promise(Kind.WHOLE, path.with_name("trust-1.toml"))
    promise(Kind.FIRST, path.with_name("trust-1.toml"), path)
    promise(Kind.WHOLE, path.with_name("trust-1.toml.sig"))
    fleet_files.create(folder / "fleet", "survey")
    promise(Kind.WHOLE, folder / "fleet" / fleet_files.SECRET_NAME)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
