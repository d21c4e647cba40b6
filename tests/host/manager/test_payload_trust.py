"""Only payloads with a key that the trust file names run; and it changes as its roots say."""

from __future__ import annotations

import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from tests.host.trust.trusted import (
    ALICE,
    BOB,
    FIRST,
    LAMP_ID,
    MALLORY,
    ROOT,
    enrol,
    lamp,
    refusal,
    resealed,
    trusting,
    until_read,
    with_trust,
)
from tests.kit.golden import Golden
from tests.kit.signing import Key, sign_payload, signed

from nondum.host.core.events.payloads import PayloadFound
from nondum.host.core.events.trust import TrustChanged, TrustFileRefused, TrustRead
from nondum.host.core.records.step import Step
from nondum.host.trust.anchors import Origin
from nondum.sdk.errors import TrustRefused
from nondum.wheelhouse.trust import trust_file
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Bounds, Revocation

pytestmark = pytest.mark.anyio

SECOND = replace(FIRST, version=2)
REVOKED = replace(SECOND, revoked=(Revocation(ALICE.public.fingerprint, "lost"),))


def changes(host: object) -> list[int]:
    return [e.version for e in host.heard if isinstance(e, TrustChanged)]  # type: ignore[attr-defined]  # a Living


async def test_what_a_trusted_key_signed_runs(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(lamp(tmp_path / "drive", ALICE))
        await host.until_step(LAMP_ID, Step.ACTIVE)
        record = host.payload(LAMP_ID)
        assert record is not None
        assert host.executor.trust.vouched(record.key).signers == ("alice",)
        assert host.catalogue.state.highwater[LAMP_ID].owner == "maker"


async def test_payload_without_a_trusted_signature_is_refused(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(lamp(tmp_path / "drive"))
        assert await refusal(host) == ["SIG_MISSING"]
        host.pull()
        await host.until_gone(LAMP_ID)
        sign_payload(tmp_path / "drive/nondum" / LAMP_ID, MALLORY)
        host.plug(tmp_path / "drive")
        assert await refusal(host) == ["SIG_UNTRUSTED"]


async def test_what_is_wrong_or_doubtful_is_told_as_a_drive_is_read(tmp_path: Path) -> None:
    later = replace(FIRST, made=datetime(2100, 1, 1, tzinfo=UTC))
    async with trusting(tmp_path, later) as host:
        host.plug(lamp(tmp_path / "drive", ALICE), "good")
        endless = SignedFile(b"#" * (trust_file.MAX_BYTES + 1), None)
        bad = with_trust(lamp(tmp_path / "other", text="# unsigned"), endless)
        host.plug(bad, "bad")
        await until_read(host, "good")
        await until_read(host, "bad")
        found = [event for event in host.heard if isinstance(event, PayloadFound)]
        told = {(one.drive[-3:], p.code) for one in found for p in (*one.problems, *one.warnings)}
        assert told == {("ood", "CLOCK_UNSURE"), ("bad", "SIG_MISSING")}
        files = [event for event in host.heard if isinstance(event, TrustFileRefused)]
        assert [event.problems[0].code for event in files] == ["TOO_LARGE"]


async def test_a_host_that_trusts_no_key_runs_nothing(tmp_path: Path, golden: Golden) -> None:
    async with trusting(tmp_path, None) as host:
        [warning] = host.executor.trust.warnings
        golden.check("the host trusts no key", warning)
        drive = with_trust(lamp(tmp_path / "drive", ALICE), signed(FIRST, ROOT))
        host.plug(drive)
        assert await refusal(host) == ["SIG_UNTRUSTED"]
        assert not changes(host)
        told = [e for e in host.heard if isinstance(e, TrustFileRefused)]
        assert [e.problems[0].code for e in told] == ["TRUST_UNANCHORED"]


async def test_a_role_must_allow_what_a_payload_asks_for(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(lamp(tmp_path / "drive", ALICE, manifest='permissions = ["network", "gpu"]'))
        assert await refusal(host) == ["PERMISSION_DENIED"]
        host.pull()
        await host.until_gone(LAMP_ID)
        host.plug(lamp(tmp_path / "other", ALICE, manifest='permissions = ["network"]'), "b")
        await host.until_step(LAMP_ID, Step.ACTIVE)
        component = host.snapshot.component("lamp")
        assert component is not None
        assert component.permissions == ("network",)


async def test_releases_only_go_up(tmp_path: Path) -> None:
    drive = lamp(tmp_path / "drive", ALICE, release=5)
    async with trusting(tmp_path) as host:
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.pull()
        await host.until_gone(LAMP_ID)
        found = {}
        for release in (4, 2**50):
            host.plug(resealed(drive, ALICE, release=release))
            found[release] = await refusal(host)
            host.pull()
            await host.until_gone(LAMP_ID)
        assert found == {4: ["ROLLBACK"], 2**50: ["RELEASE_JUMP"]}
        host.plug(lamp(tmp_path / "other", BOB, release=5, text="\n# another one\n"))
        assert await refusal(host) == ["RELEASE_CONFLICT"]


async def test_the_owner_undoes_a_release_that_went_too_far(tmp_path: Path) -> None:
    """A key was stolen, and a payload of release 1,000,000,000 keeps out all genuine ones."""
    drive = lamp(tmp_path / "drive", ALICE, release=1_000_000_000)
    async with trusting(tmp_path) as host:
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.pull()
        await host.until_gone(LAMP_ID)
        bounded = replace(SECOND, bounds=(Bounds(LAMP_ID, least=3, most=1000),))
        with_trust(tmp_path / "cure", signed(bounded, ROOT))
        host.plug(tmp_path / "cure", "b")
        await host.until(lambda: changes(host) == [2])
        host.plug(drive)
        assert await refusal(host) == ["RELEASE_JUMP"]
        host.pull()
        await host.until_gone(LAMP_ID)
        host.plug(resealed(drive, ALICE, release=7))
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert host.catalogue.state.highwater[LAMP_ID].release == 7


async def test_an_id_stays_with_the_role_that_brought_it_first(tmp_path: Path) -> None:
    roles = (
        replace(FIRST.roles[0], name="one", keys=("alice",)),
        replace(FIRST.roles[0], name="two", keys=("bob",)),
    )
    drive = lamp(tmp_path / "drive", ALICE, release=5)
    async with trusting(tmp_path, replace(FIRST, roles=roles)) as host:
        host.plug(drive)
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.pull()
        await host.until_gone(LAMP_ID)
        host.plug(resealed(drive, BOB, release=6))
        assert await refusal(host) == ["ID_OWNED_BY"]


# The trust file changes


async def test_a_drive_brings_the_next_trust_file_before_its_payloads(tmp_path: Path) -> None:
    carol = Key("carol")
    role = replace(FIRST.roles[0], keys=("carol",))
    second = replace(SECOND, keys=(carol.trusted(),), roles=(role,))
    async with trusting(tmp_path) as host:
        host.plug(with_trust(lamp(tmp_path / "drive", carol), signed(second, ROOT)))
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert changes(host) == [2]
        entries = [entry.event for entry in await host.journal()]
        assert entries.index("TrustChanged") < entries.index("PayloadFound")
    async with trusting(tmp_path) as host:
        await host.until_step(LAMP_ID, Step.ACTIVE)
        trust = host.executor.trust.trust
        assert trust is not None
        assert trust.version == 2


async def test_a_drive_may_bring_nothing_else(tmp_path: Path) -> None:
    drive = with_trust(tmp_path / "drive", signed(SECOND, ROOT))
    async with trusting(tmp_path) as host:
        host.plug(drive)
        await until_read(host)
        assert changes(host) == [2]
        (record,) = host.snapshot.drives
        assert not record.problems
        host.plug(drive, "b")
        await until_read(host, "b")
        assert changes(host) == [2]
        assert not [e for e in host.heard if isinstance(e, TrustFileRefused)]


FALSE = {
    "TRUST_SIGNATURE": signed(SECOND, MALLORY),
    "TRUST_VERSION": signed(replace(SECOND, version=3), ROOT),
    "TRUST_CONFLICT": signed(replace(FIRST, fleets=("other",)), ROOT),
    "TRUST_OWNER": signed(replace(SECOND, owner="mallory"), ROOT),
}


async def test_false_trust_files_are_told_and_change_nothing(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        for code, file in FALSE.items():
            host.plug(with_trust(tmp_path / code, file), code)
            await until_read(host, code)
        host.plug(lamp(tmp_path / "drive", ALICE))
        await host.until_step(LAMP_ID, Step.ACTIVE)
        assert not changes(host)
        entries = [e for e in await host.journal() if e.event == "TrustFileRefused"]
        told = {entry.subject: [problem.code for problem in entry.problems] for entry in entries}
        assert told == {code: [code] for code in FALSE}
        assert all(problem.fix for entry in entries for problem in entry.problems)


async def test_a_payload_ends_when_its_key_is_revoked(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(lamp(tmp_path / "drive", ALICE))
        await host.until_step(LAMP_ID, Step.ACTIVE)
        host.plug(with_trust(tmp_path / "news", signed(REVOKED, ROOT)), "b")
        assert await refusal(host) == ["SIG_REVOKED"]
        assert not host.snapshot.components
        host.pull()
        await host.until_gone(LAMP_ID)
        assert not host.workers.pids()


async def test_a_payload_with_a_revoked_key_may_go_on_and_says_so(tmp_path: Path) -> None:
    async with trusting(tmp_path, stop=False) as host:
        host.plug(lamp(tmp_path / "drive", ALICE))
        record = await host.until_step(LAMP_ID, Step.ACTIVE)
        host.plug(with_trust(tmp_path / "news", signed(REVOKED, ROOT)), "b")
        await host.until(lambda: bool(getattr(host.payload(LAMP_ID), "problems", ())))
        record = host.payload(LAMP_ID) or record
        assert record.step is Step.ACTIVE
        assert [problem.code for problem in record.problems] == ["SIG_REVOKED"]
        third = replace(REVOKED, version=3, revoked=())
        host.plug(with_trust(tmp_path / "again", signed(third, ROOT)), "c")
        await host.until(lambda: not getattr(host.payload(LAMP_ID), "problems", (1,)))


async def test_what_lost_its_trust_while_the_host_slept_does_not_start(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(lamp(tmp_path / "drive", ALICE))
        await host.until_step(LAMP_ID, Step.ACTIVE)
    enrol(tmp_path, REVOKED)
    async with trusting(tmp_path) as host:
        assert await refusal(host) == ["SIG_REVOKED"]
        assert not host.workers.pids()
        assert not [e for e in await host.journal() if e.event == "WorkerReady"][1:]


async def test_what_cannot_be_judged_again_is_not_trusted(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(lamp(tmp_path / "drive", ALICE))
        record = await host.until_step(LAMP_ID, Step.ACTIVE)
        (host.folders.payload(record.key) / "CONTENTS").unlink()
        host.plug(with_trust(tmp_path / "news", signed(SECOND, ROOT)), "b")
        assert await refusal(host) == ["IO_ERROR"]


# What is on disk


async def test_an_update_that_was_changed_on_disk_is_not_believed(tmp_path: Path) -> None:
    async with trusting(tmp_path) as host:
        host.plug(with_trust(tmp_path / "drive", signed(SECOND, ROOT)))
        await until_read(host)
    kept = tmp_path / "state/trust/00000002.toml"
    kept.write_bytes(kept.read_bytes().replace(b"survey", b"mallor"))
    async with trusting(tmp_path) as host:
        trust = host.executor.trust.trust
        assert trust == FIRST
        assert any("TRUST_SIGNATURE" in warning for warning in host.executor.trust.warnings)


async def test_a_first_file_that_other_users_can_write_is_not_believed(tmp_path: Path) -> None:
    enrol(tmp_path).chmod(0o666)
    async with trusting(tmp_path) as host:
        assert host.executor.trust.trust is None
        assert any("TRUST_OPEN_TO_OTHERS" in w for w in host.executor.trust.warnings)
        host.plug(lamp(tmp_path / "drive", ALICE))
        assert await refusal(host) == ["SIG_UNTRUSTED"]


@pytest.mark.parametrize("signers", [(), (ROOT,)])
async def test_it_is_told_whether_the_first_file_is_signed(
    tmp_path: Path, signers: tuple[Key, ...]
) -> None:
    anchor = enrol(tmp_path, SECOND)
    if (signature := signed(SECOND, *signers).signature) is not None:
        anchor.with_name("trust.toml.sig").write_bytes(signature)
    placed = Origin.ROOT if os.geteuid() == 0 else Origin.USER
    first = (Origin.SIGNED if signers else placed).value
    async with trusting(tmp_path) as host:
        trust = host.executor.trust
        assert trust.row()["first"] == first
        assert trust.summary() == {"owner": "survey", "version": 2, "first": first}
        assert not trust.warnings
        await host.until(lambda: TrustRead("survey", 2, first) in host.heard)
        third = signed(replace(SECOND, version=3), ROOT)
        assert await trust.give(third) == (TrustChanged("survey", 3, "a person"),)
        assert trust.summary() == {"owner": "survey", "version": 3, "first": first}


async def test_a_first_file_that_is_signed_falsely_is_not_believed(tmp_path: Path) -> None:
    anchor = enrol(tmp_path)
    anchor.with_name("trust.toml.sig").write_bytes(signed(FIRST, MALLORY).signature or b"")
    async with trusting(tmp_path) as host:
        trust = host.executor.trust
        assert (trust.trust, trust.summary(), trust.row()["first"]) == (None, None, "")
        assert any("TRUST_SIGNATURE" in warning for warning in trust.warnings)
        host.plug(lamp(tmp_path / "drive", ALICE))
        assert await refusal(host) == ["SIG_UNTRUSTED"]
        assert not [event for event in host.heard if isinstance(event, TrustRead)]


async def test_a_first_file_that_is_none_is_told(tmp_path: Path) -> None:
    enrol(tmp_path).write_text("version = 1\n")
    async with trusting(tmp_path) as host:
        assert host.executor.trust.trust is None
        assert any("TRUST_KEY" in warning for warning in host.executor.trust.warnings)


async def test_people_bring_the_next_trust_file_too(tmp_path: Path) -> None:
    async with trusting(tmp_path, None) as host:
        trust = host.executor.trust
        with pytest.raises(TrustRefused, match="TRUST_MISSING"):
            await trust.reload()
        with pytest.raises(TrustRefused, match="TRUST_UNANCHORED"):
            await trust.give(signed(SECOND, ROOT))
        enrol(tmp_path)
        (event,) = await trust.reload()
        assert event == TrustChanged("survey", 1, "a person")
        assert await trust.reload() == ()
        (event,) = await trust.give(signed(SECOND, ROOT))
        assert event == TrustChanged("survey", 2, "a person")
        assert await trust.give(signed(SECOND, ROOT)) == ()
        with pytest.raises(TrustRefused, match="TRUST_SIGNATURE"):
            await trust.give(signed(replace(SECOND, version=3), MALLORY))
