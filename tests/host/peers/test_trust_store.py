"""The keys and the trust that a host stores: on disk, active, and kept whatever happens."""

from __future__ import annotations

import asyncio
import os
import stat
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from nondum.host.jobs.certificates import certificates_on
from nondum.host.peers.trust_store import CERTIFICATE_NAME, KEY_NAME, TRUST_NAME, PeerTrustStore
from nondum.transport.peers import HostKeys, PeerKey, PeerRefused, Security, Trust, private_file
from nondum.transport.peers.certificate import issue, new_fleet
from nondum.transport.peers.public_file import FleetPublic
from nondum.transport.peers.trust import TrustState

pytestmark = pytest.mark.anyio

NOW = datetime(2026, 6, 1, tzinfo=UTC)
ROVER, BASE = HostKeys.generate().public, HostKeys.generate().public
(SURVEY, SURVEY_SECRET), (OTHERS, OTHERS_SECRET) = new_fleet(), new_fleet()


@dataclass
class Told:
    """What the rest of the host hears."""

    trusts: list[Trust] = field(default_factory=list)
    certificates: list[bytes] = field(default_factory=list)


async def open_store(folder: Path, told: Told | None = None, name: str = "base") -> PeerTrustStore:
    told = told or Told()
    return await PeerTrustStore.open(
        folder / "peers",
        name,
        on_change=told.trusts.append,
        on_certificate=told.certificates.append,
        clock=lambda: NOW,
    )


def signed(
    key: PeerKey, *, secret: bytes = SURVEY_SECRET, host: str = "base", days: float = 30
) -> bytes:
    begins, ends = NOW - timedelta(days=60), NOW + timedelta(days=days)
    return issue(secret, host, key, not_before=begins, not_after=ends).to_bytes()


async def test_first_start_makes_a_key_that_stays(tmp_path: Path) -> None:
    first = await open_store(tmp_path)
    assert first.identity().key == first.key == (await open_store(tmp_path)).key
    assert stat.S_IMODE((tmp_path / "peers" / KEY_NAME).stat().st_mode) == 0o600
    assert (first.trust, first.certificate, first.warnings) == (Trust(), None, ())


async def test_development_has_no_keys_to_show(tmp_path: Path) -> None:
    assert (await open_store(tmp_path)).identity(development=True).security is Security.DEVELOPMENT


async def test_every_change_is_told_and_kept(tmp_path: Path) -> None:
    told = Told()
    kept = await open_store(tmp_path, told)
    await kept.pair(ROVER, "rover")
    await kept.trust_fleet(FleetPublic(SURVEY, "survey"))
    await kept.revoke(BASE, "stolen")
    assert kept.trust == Trust({SURVEY: "survey"}, {ROVER: "rover"}, {BASE: "stolen"})
    assert told.trusts[-1] == kept.trust == (await open_store(tmp_path)).trust
    for key in (ROVER, SURVEY, BASE):
        await kept.forget(key)
    assert told.trusts[-1] == (await open_store(tmp_path)).trust == Trust()
    assert len(told.trusts) == 6


async def test_revoked_key_is_not_paired_again(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    await kept.revoke(ROVER, "stolen")
    with pytest.raises(PeerRefused, match="KEY_REVOKED"):
        await kept.pair(ROVER, "rover")


async def test_own_key_is_not_revoked(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    with pytest.raises(PeerRefused, match="KEY_OWN"):
        await kept.revoke(kept.key, "stolen")
    assert kept.trust == Trust()


async def test_host_is_let_in_once_that_is_kept(tmp_path: Path) -> None:
    told = Told()
    kept = await open_store(tmp_path, told)
    (tmp_path / "peers" / TRUST_NAME).mkdir()  # nothing can be put in its place
    with pytest.raises(PeerRefused, match=f"PEERS_FOLDER .*{TRUST_NAME}"):
        await kept.pair(ROVER, "rover")
    assert kept.trust.state_of(ROVER) is TrustState.UNKNOWN
    assert told.trusts == []


async def test_host_is_kept_out_even_if_that_cannot_be_kept(tmp_path: Path) -> None:
    told = Told()
    kept = await open_store(tmp_path, told)
    (tmp_path / "peers" / TRUST_NAME).mkdir()
    with pytest.raises(PeerRefused, match="PEERS_FOLDER"):
        await kept.revoke(ROVER, "stolen")
    assert kept.trust.state_of(ROVER) is told.trusts[-1].state_of(ROVER) is TrustState.REVOKED


async def test_revoking_beats_a_pairing_that_is_being_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = await open_store(tmp_path)
    loop, writes, revoked = asyncio.get_running_loop(), asyncio.Event(), asyncio.Event()
    replace = private_file.replace

    def slow(path: Path, text: str) -> None:
        loop.call_soon_threadsafe(writes.set)
        asyncio.run_coroutine_threadsafe(revoked.wait(), loop).result()
        replace(path, text)

    monkeypatch.setattr(private_file, "replace", slow)
    pairing = asyncio.ensure_future(kept.pair(ROVER, "rover"))
    await writes.wait()
    revoking = asyncio.ensure_future(kept.revoke(ROVER, "stolen"))
    await asyncio.sleep(0)
    assert kept.trust.state_of(ROVER) is TrustState.REVOKED  # before anything is on disk
    revoked.set()
    with pytest.raises(PeerRefused, match="KEY_REVOKED"):
        await pairing
    await revoking
    assert (await open_store(tmp_path)).trust == kept.trust == Trust(revoked={ROVER: "stolen"})


async def test_changes_at_once_are_all_kept(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    keys = [HostKeys.generate().public for _ in range(20)]
    await asyncio.gather(*(kept.pair(key, f"rover-{i}") for i, key in enumerate(keys)))
    assert set((await open_store(tmp_path)).trust.paired) == set(keys)


async def test_caller_that_leaves_does_not_break_the_file(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    for number in range(10):
        leaving = asyncio.ensure_future(kept.pair(ROVER, f"rover-{number}"))
        await asyncio.sleep(0)
        leaving.cancel()
        await asyncio.wait({leaving})
    await kept.pair(ROVER, "rover")
    assert (await open_store(tmp_path)).trust == Trust(paired={ROVER: "rover"})


@pytest.mark.parametrize(
    ("name", "mode", "code"),
    [
        (KEY_NAME, 0o640, "FILE_OPEN_TO_OTHERS"),
        (TRUST_NAME, 0o620, "FILE_OPEN_TO_OTHERS"),
        (CERTIFICATE_NAME, 0o602, "FILE_OPEN_TO_OTHERS"),
    ],
)
async def test_file_that_other_users_may_use_is_named(
    tmp_path: Path, name: str, mode: int, code: str
) -> None:
    kept = await open_store(tmp_path)
    await kept.pair(ROVER, "rover")
    await kept.certify(signed(kept.key))
    (tmp_path / "peers" / name).chmod(mode)
    with pytest.raises(PeerRefused, match=f"{code} .*{name}"):
        await open_store(tmp_path)


async def test_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "peers").write_text("in the way")
    with pytest.raises(PeerRefused, match=r"PEERS_FOLDER .*peers"):
        await open_store(tmp_path)


async def test_own_certificate_is_shown_and_kept(tmp_path: Path) -> None:
    """Also of a fleet that this host does not trust: this host lets no host in by it."""
    told = Told()
    kept = await open_store(tmp_path, told)
    certificate = signed(kept.key)
    found = await kept.certify(certificate)
    assert (found.host, found.key) == ("base", kept.key)
    assert kept.identity().certificate == certificate == told.certificates[-1]
    assert (await open_store(tmp_path)).identity().certificate == certificate
    assert kept.trust == Trust()


@pytest.mark.parametrize(
    ("certificate", "code"),
    [
        (lambda key: signed(ROVER), "CERTIFICATE_KEY"),
        (lambda key: signed(key, host="rover"), "CERTIFICATE_NAME"),
        (lambda key: signed(key, days=-2), "CERTIFICATE_TIME"),
        (lambda key: signed(key).replace(b"2026-07", b"2029-07"), "CERTIFICATE_SIGNATURE"),
        (lambda key: b"certificate", "CERTIFICATE_MALFORMED"),
        (lambda key: b"\xff" * 2000, "CERTIFICATE_MALFORMED"),
    ],
    ids=["another host's", "another name", "ended", "changed", "no certificate", "long"],
)
async def test_certificate_that_does_not_hold_is_refused(
    tmp_path: Path,
    certificate: object,
    code: str,
) -> None:
    kept = await open_store(tmp_path)
    assert callable(certificate)
    with pytest.raises(PeerRefused, match=code):
        await kept.certify(certificate(kept.key))
    assert await kept.offer(certificate(kept.key)) is None
    assert kept.identity().certificate == b""
    assert not (tmp_path / "peers" / CERTIFICATE_NAME).exists()


async def test_certificate_is_taken_from_a_drive_where_there_is_none(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    assert await kept.offer(signed(kept.key)) is not None
    assert kept.identity().certificate == signed(kept.key)


async def test_drive_renews_a_certificate(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    await kept.certify(signed(kept.key, days=30))
    assert await kept.offer(signed(kept.key, days=20)) is None
    assert await kept.offer(signed(kept.key, days=40)) is not None


async def test_drive_of_strangers_does_not_displace_a_certificate(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    await kept.certify(signed(kept.key))
    assert await kept.offer(signed(kept.key, secret=OTHERS_SECRET, days=3000)) is None
    assert kept.certificate is not None
    assert kept.certificate.fleet == SURVEY
    await kept.certify(signed(kept.key, secret=OTHERS_SECRET))  # a person may
    assert kept.certificate.fleet == OTHERS


async def test_certificate_of_another_name_is_warned_of_at_the_start(tmp_path: Path) -> None:
    kept = await open_store(tmp_path)
    await kept.certify(signed(kept.key))
    renamed = await open_store(tmp_path, name="base-2")
    assert [problem.code for problem in renamed.warnings] == ["CERTIFICATE_NAME"]
    assert renamed.identity().certificate == b""


async def test_certificate_that_ended_is_warned_of_and_shown(tmp_path: Path) -> None:
    """The clock of a host without a battery may be set later."""
    kept = await open_store(tmp_path)
    await kept.certify(signed(kept.key))
    late = await PeerTrustStore.open(
        tmp_path / "peers", "base", clock=lambda: NOW + timedelta(days=99)
    )
    assert [problem.code for problem in late.warnings] == ["CERTIFICATE_TIME"]
    assert late.identity().certificate == signed(kept.key)
    assert await kept.offer(signed(kept.key, secret=OTHERS_SECRET)) is None
    assert await late.offer(signed(kept.key, secret=OTHERS_SECRET, days=200)) is not None


def test_certificates_are_found_on_a_drive(tmp_path: Path) -> None:
    folder = tmp_path / "nondum-peers"
    folder.mkdir()
    for name in ("certificate", "rover.certificate", "fleet.pub", "notes.txt"):
        (folder / name).write_bytes(name.encode())
    (folder / "empty.certificate").touch()
    assert list(certificates_on(tmp_path)) == [b"certificate", b"rover.certificate"]


def test_what_else_a_drive_holds_is_passed_over(tmp_path: Path) -> None:
    assert list(certificates_on(tmp_path)) == []
    folder = tmp_path / "nondum-peers"
    folder.mkdir()
    secret = tmp_path / "secret"
    secret.write_text("not for the drive's maker")
    (folder / "link.certificate").symlink_to(secret)
    (folder / "folder.certificate").mkdir()
    (folder / "long.certificate").write_bytes(b"x" * 2000)
    os.mkfifo(folder / "pipe.certificate")
    assert list(certificates_on(tmp_path)) == []


def test_folder_of_a_drive_that_leads_elsewhere_is_passed_over(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "certificate").write_text("x")
    drive = tmp_path / "drive"
    drive.mkdir()
    (drive / "nondum-peers").symlink_to(elsewhere)
    assert list(certificates_on(drive)) == []
