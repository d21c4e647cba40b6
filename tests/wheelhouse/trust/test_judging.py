"""The signers that a payload is believed from, and the refusal of each attack on that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.signing import MADE, NOW, Key, trust_of

from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.format.manifest import PERMISSIONS, ComponentManifest, Manifest, Requires
from nondum.wheelhouse.format.signatures import Grant, Verdict
from nondum.wheelhouse.trust import sshsig
from nondum.wheelhouse.trust.judging import (
    EARLIEST,
    Circumstances,
    Developing,
    Judging,
    clock_floor,
    judge,
)
from nondum.wheelhouse.trust.trust import Bounds, Revocation, Trust

ROOT, ALICE, BOB, CAROL = Key("root"), Key("alice"), Key("bob"), Key("carol")
TOKEN = Key("token", fido=True)
HERE = Circumstances("spot", NOW)
TRUST = trust_of(
    roots=[ROOT],
    roles={"maker": (["org.example"], [ALICE, TOKEN]), "acme": (["com.acme"], [BOB])},
    permissions=["network"],
    fleets=["survey"],
)


def listed(payload_id: str = "org.example.lamp", **changes: object) -> bytes:
    plain = Contents(
        payload_id=payload_id,
        version="1.0",
        release=7,
        fleet="",
        minimum_nondum="0.1",
        built="2026-08-15T00:00:00Z",
        entries=(Entry("a" * 64, 1, "payload.toml"),),
    )
    return replace(plain, **changes).to_bytes()  # type: ignore[arg-type]  # as the fields are


LIST = listed()


def judged(
    *signers: Key,
    data: bytes = LIST,
    trust: Trust | None = TRUST,
    at: Circumstances = HERE,
) -> Verdict:
    signature = b"".join(key.sign(data, sshsig.PAYLOAD) for key in signers)
    return judge(trust, data, signature or None, at)


def codes(verdict: Verdict) -> list[str]:
    assert all(problem.fix for problem in (*verdict.problems, *verdict.warnings))
    return [problem.code for problem in verdict.problems]


@pytest.mark.parametrize("key", [ALICE, TOKEN], ids=["file", "fido"])
def test_who_has_a_role_for_the_id_is_believed(key: Key) -> None:
    verdict = judged(key)
    assert verdict == Verdict(
        (key.name,), grant=Grant(("network",), role="maker", owners=("maker",))
    )


def test_nothing_is_believed_without_signature() -> None:
    assert codes(judged()) == ["SIG_MISSING"]


def test_a_list_that_is_none_is_not_even_parsed_unsigned() -> None:
    assert codes(judged(data=b"\xff" * 300_000)) == ["SIG_MISSING"]
    assert codes(judged(CAROL, data=b"\xff")) == ["SIG_UNTRUSTED"]
    assert codes(judged(ALICE, data=b"\xff")) == ["CONTENTS_ENCODING"]


def test_a_host_without_trust_file_trusts_no_signer_and_says_how_to_begin() -> None:
    (problem,) = judged(ALICE, trust=None).problems
    assert problem.code == "SIG_UNTRUSTED"
    assert problem.have == ALICE.public.fingerprint
    assert "nondum keys trust" in problem.fix


def test_an_unknown_key_is_told_with_the_command_that_would_trust_it() -> None:
    (problem,) = judged(CAROL).problems
    assert problem.code == "SIG_UNTRUSTED"
    assert problem.have == CAROL.public.fingerprint
    assert f"nondum keys allow FILE '{CAROL.public.line}'" in problem.fix


def test_roots_sign_trust_files_and_no_payloads() -> None:
    assert codes(judged(ROOT)) == ["SIG_UNTRUSTED"]


def test_the_other_half_of_a_signature_is_of_no_use() -> None:
    """A key of one kind does not stand for the same point as another kind."""
    twin = Key("token")
    assert twin.public.point == TOKEN.public.point
    assert codes(judged(twin)) == ["SIG_UNTRUSTED"]


@pytest.mark.parametrize("namespace", ["git", "file", sshsig.TRUST, "nondum-payload@2", ""])
def test_signatures_for_other_purposes_are_refused(namespace: str) -> None:
    verdict = judge(TRUST, LIST, ALICE.sign(LIST, namespace), HERE)
    assert codes(verdict) == ["SIG_WRONG_PURPOSE"]


def test_one_signature_for_another_purpose_spoils_the_file() -> None:
    both = ALICE.sign(LIST, sshsig.PAYLOAD) + BOB.sign(LIST, "git")
    assert codes(judge(TRUST, LIST, both, HERE)) == ["SIG_WRONG_PURPOSE"]


def test_no_byte_of_the_list_can_be_changed() -> None:
    signature = ALICE.sign(LIST, sshsig.PAYLOAD)
    for place in range(0, len(LIST), 7):
        changed = LIST[:place] + bytes([LIST[place] ^ 1]) + LIST[place + 1 :]
        assert codes(judge(TRUST, changed, signature, HERE)) == ["SIG_INVALID"]


def test_signatures_of_one_release_are_of_no_use_for_another() -> None:
    assert codes(judge(TRUST, listed(release=8), ALICE.sign(LIST, sshsig.PAYLOAD), HERE)) == [
        "SIG_INVALID"
    ]


def test_a_signature_that_does_not_hold_spoils_the_file() -> None:
    both = ALICE.sign(LIST, sshsig.PAYLOAD) + BOB.sign(b"other", sshsig.PAYLOAD)
    assert codes(judge(TRUST, LIST, both, HERE)) == ["SIG_INVALID"]


# Roles


def test_ids_are_their_roles() -> None:
    (problem,) = judged(BOB).problems
    assert problem.code == "ID_OWNED_BY"
    assert problem.need == "maker (alice, token)"


def test_a_role_ends_at_a_dot() -> None:
    assert codes(judged(ALICE, data=listed("org.example-evil.lamp"))) == ["ID_NOT_ALLOWED"]


def test_the_closest_role_alone_has_an_id() -> None:
    """Else a signer that may bring anything could replace what a maker has brought."""
    trust = trust_of(roots=[ROOT], roles={"all": (["*"], [ALICE]), "acme": (["com.acme"], [BOB])})
    assert codes(judged(ALICE, trust=trust)) == []
    assert codes(judged(ALICE, data=listed("com.acme.arm"), trust=trust)) == ["ID_OWNED_BY"]
    assert codes(judged(BOB, data=listed("com.acme.arm"), trust=trust)) == []


def test_roles_of_one_id_are_told_who_was_first() -> None:
    trust = trust_of(
        roots=[ROOT], roles={"one": (["org.example"], [ALICE]), "two": (["org.example"], [BOB])}
    )
    assert judged(BOB, trust=trust).grant == Grant((), role="two", owners=("one", "two"))


@pytest.mark.parametrize(
    ("signers", "found"),
    [
        ([ALICE, BOB], []),
        ([ALICE], ["SIG_TOO_FEW"]),
        ([ALICE, ALICE], ["SIG_TOO_FEW"]),
        ([ALICE, CAROL], ["SIG_UNTRUSTED", "SIG_TOO_FEW"]),
    ],
    ids=["two", "one", "one twice", "one and a stranger"],
)
def test_thresholds_count_keys_of_the_role(signers: Sequence[Key], found: list[str]) -> None:
    trust = trust_of(roots=[ROOT], roles={"maker": (["*"], [ALICE, BOB])}, threshold=2)
    assert codes(judged(*signers, trust=trust)) == found


def test_keys_of_another_role_do_not_count() -> None:
    trust = trust_of(roots=[ROOT], roles={"maker": (["*"], [ALICE, BOB])}, threshold=2)
    roles = (*trust.roles, replace(trust.roles[0], name="other", payloads=("com.other",)))
    trust = replace(trust, keys=(*trust.keys, CAROL.trusted()), roles=roles)
    assert codes(judged(ALICE, CAROL, trust=trust)) == ["SIG_TOO_FEW"]


def test_a_stranger_beside_those_who_suffice_does_no_harm() -> None:
    verdict = judged(ALICE, CAROL)
    assert codes(verdict) == []
    assert verdict.signers == ("alice", CAROL.public.fingerprint)


# Revocation


REVOKED = replace(TRUST, revoked=(Revocation(ALICE.public.fingerprint, "lost"),))


def test_revoked_keys_are_not_believed() -> None:
    (problem,) = judged(ALICE, trust=REVOKED).problems
    assert problem.code == "SIG_REVOKED"
    assert "lost" in problem.message


def test_a_revocation_holds_for_keys_that_are_not_named() -> None:
    trust = replace(TRUST, revoked=(Revocation(CAROL.public.fingerprint),))
    assert codes(judged(CAROL, trust=trust)) == ["SIG_REVOKED"]


def test_revoked_keys_do_not_count() -> None:
    assert codes(judged(ALICE, TOKEN, trust=REVOKED)) == []
    two = replace(REVOKED, roles=(replace(TRUST.roles[0], threshold=2), TRUST.roles[1]))
    assert codes(judged(ALICE, TOKEN, trust=two)) == ["SIG_REVOKED", "SIG_TOO_FEW"]


# Time


def lasting(since: datetime | None = None, until: datetime | None = None) -> Trust:
    return replace(TRUST, keys=(ALICE.trusted(since, until),))


def test_keys_end() -> None:
    trust = lasting(until=NOW)
    assert codes(judged(ALICE, trust=trust)) == ["SIG_EXPIRED"]
    before = replace(HERE, now=NOW - timedelta(seconds=1))
    assert codes(judged(ALICE, trust=trust, at=before)) == []


def test_keys_begin() -> None:
    trust = lasting(since=NOW)
    before = replace(HERE, now=NOW - timedelta(seconds=1))
    assert codes(judged(ALICE, trust=trust, at=before)) == ["SIG_NOT_YET"]
    assert codes(judged(ALICE, trust=trust)) == []


def test_a_clock_that_is_wrong_is_told_and_keeps_nothing_out() -> None:
    at = replace(HERE, now=datetime(1970, 1, 1, tzinfo=UTC))
    verdict = judged(ALICE, trust=lasting(MADE + timedelta(1), NOW), at=at)
    assert codes(verdict) == []
    assert [problem.code for problem in verdict.warnings] == ["CLOCK_UNSURE"]


def test_a_clock_that_is_wrong_brings_no_key_back() -> None:
    """The roots have signed since that it is later."""
    at = replace(HERE, now=datetime(1970, 1, 1, tzinfo=UTC))
    assert codes(judged(ALICE, trust=lasting(until=MADE), at=at)) == ["SIG_EXPIRED"]


def test_only_roots_say_that_it_is_later() -> None:
    assert clock_floor(None) == EARLIEST
    assert clock_floor(TRUST) == MADE
    assert clock_floor(replace(TRUST, made=EARLIEST - timedelta(1))) == EARLIEST
    assert datetime.now(UTC) > EARLIEST
    late = judged(
        ALICE, data=listed(built="2999-01-01T00:00:00Z"), trust=lasting(until=NOW + timedelta(1))
    )
    assert codes(late) == []


def test_time_can_be_left_out() -> None:
    at = Circumstances("spot")
    assert codes(judged(ALICE, trust=lasting(until=MADE), at=at)) == []


# Target and releases


def test_payloads_of_other_fleets_are_refused() -> None:
    assert codes(judged(ALICE, data=listed(fleet="survey"))) == []
    (problem,) = judged(ALICE, data=listed(fleet="rescue")).problems
    assert problem.code == "WRONG_TARGET"


def test_payloads_for_other_hosts_are_refused() -> None:
    data = listed(hosts=("rover", "spot"))
    assert codes(judged(ALICE, data=data)) == []
    assert codes(judged(ALICE, data=data, at=replace(HERE, host="panther"))) == ["WRONG_TARGET"]
    assert codes(judged(ALICE, data=data, at=replace(HERE, host=""))) == []


def test_the_owner_bounds_releases() -> None:
    trust = replace(TRUST, bounds=(Bounds("org.example.lamp", 6, 8),))
    found = {n: codes(judged(ALICE, data=listed(release=n), trust=trust)) for n in (5, 6, 8, 9)}
    assert found == {5: ["ROLLBACK"], 6: [], 8: [], 9: ["RELEASE_JUMP"]}
    assert judged(ALICE, trust=trust).grant.most_release == 8
    assert codes(judged(ALICE, data=listed("org.example.other", release=1), trust=trust)) == []


# Permissions


def manifest(*permissions: str) -> Manifest:
    component = ComponentManifest("lamp", "lamp", permissions=permissions)
    return Manifest("org.example.lamp", "Lamp", "", (), "", "", Requires(), (component,))


def test_a_role_gives_what_it_may() -> None:
    grant = judged(ALICE).grant
    assert grant.problems(manifest("network")) == ()
    (problem,) = grant.problems(manifest("network", "gpu"))
    assert (problem.code, problem.where, problem.need) == ("PERMISSION_DENIED", "lamp", "gpu")
    assert problem.fix


def test_a_role_may_give_everything() -> None:
    trust = trust_of(roots=[ROOT], roles={"all": (["*"], [ALICE])}, permissions=["*"])
    assert judged(ALICE, trust=trust).grant.problems(manifest(*PERMISSIONS)) == ()


def test_what_is_refused_is_granted_nothing() -> None:
    assert judged(CAROL).grant == Grant()
    assert Grant().problems(manifest("network")) != ()


# Verifiers


def test_developers_need_not_sign() -> None:
    verdict = Developing(TRUST, HERE).verify(LIST, None)
    assert (verdict.problems, verdict.signers) == ((), ())
    assert verdict.grant.problems(manifest(*PERMISSIONS)) == ()


def test_what_developers_sign_is_judged_where_there_is_trust() -> None:
    signature = ALICE.sign(LIST, sshsig.PAYLOAD)
    assert codes(Developing(REVOKED, HERE).verify(LIST, signature)) == ["SIG_REVOKED"]
    assert codes(Developing(None, HERE).verify(LIST, signature)) == []


def test_a_host_judges_by_its_trust() -> None:
    signature = ALICE.sign(LIST, sshsig.PAYLOAD)
    assert codes(Judging(TRUST, HERE).verify(LIST, signature)) == []
    assert codes(Judging(None, HERE).verify(LIST, None)) == ["SIG_MISSING"]


@given(
    st.lists(st.sampled_from([ALICE, BOB, CAROL, TOKEN, ROOT]), max_size=5),
    st.sets(st.sampled_from([ALICE, BOB, TOKEN])),
    st.integers(1, 3),
)
def test_a_payload_is_believed_exactly_when_enough_live_keys_signed(
    signers: list[Key], gone: set[Key], threshold: int
) -> None:
    group = [ALICE, BOB, TOKEN]
    trust = replace(
        trust_of(roots=[ROOT], roles={"maker": (["*"], group)}, threshold=threshold),
        revoked=tuple(Revocation(key.public.fingerprint) for key in gone),
    )
    enough = len({*signers} & {*group} - gone) >= threshold
    assert (judged(*signers, trust=trust).problems == ()) is enough


@given(st.binary(max_size=300), st.none() | st.binary(max_size=300))
def test_noise_is_refused_and_nothing_raised(data: bytes, signature: bytes | None) -> None:
    assert judge(TRUST, data, signature, HERE).problems
    assert judge(TRUST, data, ALICE.sign(data, sshsig.PAYLOAD), HERE).problems
