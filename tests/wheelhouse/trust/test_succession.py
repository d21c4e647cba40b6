"""How one trust file follows another, and every way in which a false one tries to (TUF, 5.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.signing import MADE, Key, signed, trust_of

from nondum.sdk.errors import NondumError, TrustRefused
from nondum.wheelhouse.trust import sshsig, succession
from nondum.wheelhouse.trust.succession import SignedFile
from nondum.wheelhouse.trust.trust import Revocation, Trust

ALICE, BOB, CAROL, DAVE = Key("alice"), Key("bob"), Key("carol"), Key("dave")
MALLORY = Key("mallory")
FIRST = trust_of(roots=[ALICE, BOB, CAROL], root_threshold=2)
SECOND = replace(FIRST, version=2, fleets=("survey",))


def refusal(file: SignedFile, trust: Trust = FIRST) -> str:
    with pytest.raises(NondumError) as refused:
        succession.successor(trust, file)
    assert all(problem.fix for problem in refused.value.problems)
    return refused.value.code


def test_the_next_version_follows() -> None:
    assert succession.successor(FIRST, signed(SECOND, ALICE, CAROL)) == SECOND


UNSIGNED = {
    "none": signed(SECOND),
    "too few": signed(SECOND, ALICE),
    "one twice": signed(SECOND, ALICE, ALICE),
    "a stranger": signed(SECOND, ALICE, MALLORY),
    "strangers": signed(SECOND, MALLORY, DAVE),
    "those of another file": replace(
        signed(SECOND, ALICE, BOB), data=signed(replace(SECOND, fleets=("other",))).data
    ),
}


@pytest.mark.parametrize("file", UNSIGNED.values(), ids=UNSIGNED)
def test_roots_alone_make_the_next_version(file: SignedFile) -> None:
    assert refusal(file) == "TRUST_SIGNATURE"


def test_signatures_over_payloads_make_no_trust() -> None:
    file = signed(SECOND, ALICE, BOB, namespace=sshsig.PAYLOAD)
    assert refusal(file) == "SIG_WRONG_PURPOSE"


def test_keys_of_roles_are_no_roots() -> None:
    trust = trust_of(roots=[ALICE], roles={"all": (["*"], [BOB])})
    assert refusal(signed(replace(trust, version=2), BOB), trust) == "TRUST_SIGNATURE"


def test_nothing_is_parsed_that_too_few_have_signed() -> None:
    bomb = "a" + ".a" * 50_000 + " = 1"
    assert refusal(signed(bomb, ALICE, MALLORY)) == "TRUST_SIGNATURE"
    assert refusal(signed(bomb, ALICE, BOB)) in ("TRUST_TOML", "TOO_LARGE")


def test_older_versions_do_not_come_back() -> None:
    for version in (1, 3, 4):
        file = signed(replace(SECOND, version=version), ALICE, BOB)
        assert refusal(file, replace(SECOND, version=5)) == "TRUST_VERSION"


def test_versions_are_not_skipped() -> None:
    for version in (3, 4, 99_999_999):
        assert refusal(signed(replace(SECOND, version=version), ALICE, BOB)) == "TRUST_VERSION"


def test_one_version_with_two_contents_is_an_alarm() -> None:
    file = signed(replace(FIRST, fleets=("other",)), ALICE, BOB)
    assert refusal(file) == "TRUST_CONFLICT"


def test_another_owner_cannot_follow() -> None:
    file = signed(replace(SECOND, owner="rescue"), ALICE, BOB)
    assert refusal(file) == "TRUST_OWNER"


def test_the_date_does_not_go_back() -> None:
    """It is what tells hosts with a clock that is wrong that keys have ended."""
    file = signed(replace(SECOND, made=MADE - timedelta(1)), ALICE, BOB)
    assert refusal(file) == "TRUST_VERSION"


# Roots that change

ROTATED = replace(SECOND, roots=trust_of(roots=[CAROL, DAVE], root_threshold=2).roots)


def test_roots_are_changed_by_both_the_old_and_the_new() -> None:
    assert succession.successor(FIRST, signed(ROTATED, ALICE, CAROL, DAVE)) == ROTATED
    assert refusal(signed(ROTATED, CAROL, DAVE)) == "TRUST_SIGNATURE"
    assert refusal(signed(ROTATED, ALICE, BOB)) == "TRUST_SIGNATURE"
    assert refusal(signed(ROTATED, ALICE, BOB, CAROL)) == "TRUST_SIGNATURE"


def test_former_roots_have_nothing_to_say_any_more() -> None:
    third = replace(ROTATED, version=3)
    assert refusal(signed(third, ALICE, BOB), ROTATED) == "TRUST_SIGNATURE"
    assert succession.successor(ROTATED, signed(third, CAROL, DAVE)) == third


def test_a_root_is_revoked_by_the_other_roots() -> None:
    gone = (Revocation(ALICE.public.fingerprint, "lost"),)
    roots = replace(FIRST.roots, keys=FIRST.roots.keys[1:])
    second = replace(SECOND, roots=roots, revoked=gone)
    assert succession.successor(FIRST, signed(second, BOB, CAROL)) == second
    assert refusal(signed(replace(second, version=3), ALICE, BOB), second) == "TRUST_SIGNATURE"
    still = replace(SECOND, revoked=gone)
    assert refusal(signed(still, BOB, CAROL)) == "TRUST_VALUE"


def test_the_current_threshold_counts_not_that_of_the_new_file() -> None:
    easier = replace(SECOND, roots=replace(FIRST.roots, threshold=1))
    assert refusal(signed(easier, MALLORY)) == "TRUST_SIGNATURE"
    assert refusal(signed(easier, ALICE)) == "TRUST_SIGNATURE"


# Several at once


def chain(length: int) -> list[SignedFile]:
    return [signed(replace(FIRST, version=version), ALICE, BOB) for version in range(2, 2 + length)]


@given(st.permutations(chain(4)))
def test_a_drive_may_carry_versions_in_any_order(files: list[SignedFile]) -> None:
    found = succession.extend(FIRST, (), files)
    assert found.trust.version == 5
    assert found.accepted == tuple(chain(4))
    assert not found.problems


def test_what_is_known_is_passed_over_in_silence() -> None:
    files = chain(3)
    found = succession.extend(FIRST, [files[0].digest], files)
    assert [problem.code for problem in found.problems] == ["TRUST_VERSION", "TRUST_VERSION"]
    second = succession.successor(FIRST, files[0])
    found = succession.extend(second, [file.digest for file in files[:1]], files)
    assert found.trust.version == 4
    assert not found.problems


def test_a_false_file_does_not_keep_out_a_true_one() -> None:
    false = signed(replace(SECOND, fleets=("mallory",)), MALLORY)
    found = succession.extend(FIRST, (), [false, *chain(2)])
    assert found.trust.version == 3
    assert [problem.code for problem in found.problems] == ["TRUST_SIGNATURE"]


def test_a_gap_ends_it() -> None:
    files = chain(4)
    found = succession.extend(FIRST, (), [files[0], files[3]])
    assert found.trust.version == 2
    assert [problem.code for problem in found.problems] == ["TRUST_VERSION"]


# The first one


def first_refusal(begin: Callable[[SignedFile], Trust], file: SignedFile) -> list[str]:
    with pytest.raises(TrustRefused) as refused:
        begin(file)
    assert all(problem.fix for problem in refused.value.problems)
    return [problem.code for problem in refused.value.problems]


FALSELY = {
    "too few": signed(FIRST, ALICE),
    "one twice": signed(FIRST, ALICE, ALICE),
    "strangers": signed(FIRST, MALLORY, DAVE),
    "one changed since": replace(
        signed(FIRST, ALICE, BOB), data=signed(replace(FIRST, fleets=("other",))).data
    ),
    "payloads' namespace": signed(FIRST, ALICE, BOB, namespace=sshsig.PAYLOAD),
    "none at all": SignedFile(signed(FIRST).data, b"signed"),
    "nothing": SignedFile(signed(FIRST).data, b""),
}


@pytest.mark.parametrize("file", FALSELY.values(), ids=FALSELY)
def test_the_first_file_is_signed_by_enough_of_its_roots(file: SignedFile) -> None:
    assert succession.first(signed(FIRST, ALICE, BOB)) == FIRST
    assert first_refusal(succession.first, file) == ["TRUST_SIGNATURE"]
    assert first_refusal(succession.first, signed(FIRST)) == ["TRUST_SIGNATURE"]


def test_what_a_carrier_adds_to_the_first_file_is_found_out() -> None:
    """The roots, and so their fingerprints, stay as they are."""
    added = trust_of(roots=[ALICE, BOB], root_threshold=2, roles={"all": (["*"], [MALLORY])})
    genuine = replace(added, keys=(), roles=())
    carried = replace(signed(genuine, ALICE, BOB), data=signed(added).data)
    for file in (carried, replace(carried, signature=None), signed(added, MALLORY)):
        assert first_refusal(succession.first, file) == ["TRUST_SIGNATURE"]


@pytest.mark.parametrize("file", FALSELY.values(), ids=FALSELY)
def test_a_placed_file_need_not_be_signed_but_not_falsely(file: SignedFile) -> None:
    assert succession.placed(signed(FIRST)) == FIRST
    assert succession.placed(signed(FIRST, ALICE, BOB)) == FIRST
    assert first_refusal(succession.placed, file) == ["TRUST_SIGNATURE"]


@given(st.binary(max_size=200), st.none() | st.binary(max_size=200))
def test_noise_is_refused_and_nothing_else_raised(data: bytes, signature: bytes | None) -> None:
    found = succession.extend(FIRST, (), [SignedFile(data, signature)])
    assert found.trust == FIRST
    assert found.problems
