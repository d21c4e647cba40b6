"""The trust file: the same value through its text, and every mistake told with its line."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit.signing import MADE, Key, trust_of

from nondum.sdk.errors import Problem, TrustRefused
from nondum.wheelhouse.trust import trust_file, trust_text
from nondum.wheelhouse.trust.trust import Bounds, Revocation, Role, Roots, Trust

ALICE, BOB, TOKEN = Key("alice"), Key("bob"), Key("token", fido=True)
FULL = replace(
    trust_of(
        roots=[ALICE, TOKEN],
        root_threshold=2,
        roles={"maker": (["org.example", "com.acme"], [BOB, TOKEN]), "lab": (["*"], [BOB])},
        permissions=["gpu", "*"],
        threshold=1,
        version=12,
        fleets=["survey", "rescue"],
    ),
    revoked=(Revocation(Key("carol").public.fingerprint, 'said "lost" \\ twice'),),
    bounds=(Bounds("org.example.lamp", 3, 9), Bounds("org.example.arm", 5)),
)
FULL = replace(
    FULL,
    keys=(BOB.trusted(FULL.made, datetime(2028, 1, 1, tzinfo=UTC)), TOKEN.trusted()),
)
PLAIN = trust_text.to_text(trust_of(roots=[ALICE], roles={"maker": (["org.example"], [BOB])}))


def problems(text: str) -> tuple[Problem, ...]:
    with pytest.raises(TrustRefused) as refused:
        trust_file.parse(text, "trust.toml")
    assert all(problem.fix for problem in refused.value.problems)
    return refused.value.problems


def test_a_trust_survives_its_text() -> None:
    assert trust_file.parse(trust_text.to_text(FULL), "trust.toml") == FULL


TIMES = st.none() | st.datetimes(
    datetime(2000, 1, 1), datetime(2100, 1, 1), timezones=st.just(UTC)
).map(lambda moment: moment.replace(microsecond=0))
PLAIN_TEXT = st.text(
    st.characters(codec="utf-8", categories=("L", "N", "P", "S", "Zs")), max_size=20
)


@given(
    st.builds(
        lambda version, made, why, names, times, threshold: replace(
            FULL,
            version=version,
            made=made,
            revoked=(Revocation(Key("carol").public.fingerprint, why),),
            keys=tuple(
                Key(name).trusted(until=until) for name, until in zip(names, times, strict=False)
            ),
            roles=(Role("all", ("*",), tuple(names), min(threshold, len(names))),),
        ),
        st.integers(1, trust_file.MAX_VERSION),
        TIMES.filter(bool),
        PLAIN_TEXT,
        st.lists(st.from_regex(r"\A[a-z0-9]{1,9}\Z"), min_size=1, max_size=4, unique=True),
        st.lists(TIMES, min_size=4, max_size=4),
        st.integers(1, 4),
    )
)
def test_any_trust_survives_its_text(trust: Trust) -> None:
    assert trust_file.parse(trust_text.to_text(trust), "trust.toml") == trust


MISTAKES = {
    "other format": ("nondum-trust 1", "nondum-trust 2", "TRUST_VALUE", 3),
    "unknown key": ("fleets =", "fleet =", "TRUST_KEY", 7),
    "unknown key in a role": ("payloads =", "payload =", "TRUST_KEY", 22),
    "no version": ("version = 1\n", "", "TRUST_VALUE", None),
    "version 0": ("version = 1", "version = 0", "TRUST_VALUE", 5),
    "version true": ("version = 1", "version = true", "TRUST_VALUE", 5),
    "a day that is none": ("2026-08-01T", "2026-02-31T", "TRUST_VALUE", 6),
    "no time zone": ("00:00Z", "00:00", "TRUST_VALUE", 6),
    "threshold 0": ("threshold = 1", "threshold = 0", "TRUST_VALUE", 10),
    "threshold above the roots": ("threshold = 1", "threshold = 2", "TRUST_VALUE", 10),
    "a name with spaces": ('name = "maker"', 'name = "the maker"', "TRUST_VALUE", 21),
    "no base64": (ALICE.public.line, "ssh-ed25519 !!", "TRUST_VALUE", 14),
    "one word": (ALICE.public.line, "ssh-ed25519", "TRUST_VALUE", 14),
    "a line without end": (ALICE.public.line, ALICE.public.line + " x" * 512, "TRUST_VALUE", 14),
    "another algorithm": ("ssh-ed25519 AAAA", "ssh-rsa AAAA", "TRUST_VALUE", 14),
    "a key of no role's": ('keys = ["bob"]', 'keys = ["eve"]', "TRUST_VALUE", 23),
    "one key twice in a role": ('keys = ["bob"]', 'keys = ["bob", "bob"]', "TRUST_TWICE", 23),
    "no keys in a role": ('keys = ["bob"]', "keys = []", "TRUST_VALUE", 23),
    "an id with capitals": ('["org.example"]', '["Org.example"]', "TRUST_VALUE", 22),
    "a permission that is none": ("permissions = []", 'permissions = ["root"]', "TRUST_VALUE", 24),
    "no TOML": ("[roots]", "[roots", "TRUST_TOML", None),
}


@pytest.mark.parametrize(("old", "new", "code", "line"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_are_told_with_their_line(old: str, new: str, code: str, line: int | None) -> None:
    assert old in PLAIN
    found = problems(PLAIN.replace(old, new, 1))
    assert code in {problem.code for problem in found}, found
    if line is not None:
        assert f"trust.toml:{line}" in {problem.where for problem in found}, found


def test_all_mistakes_are_told_at_once() -> None:
    text = PLAIN.replace("owner", "ower").replace("threshold = 1", "threshold = 0")
    assert len(problems(text)) >= 3
    assert any("'owner'" in problem.fix for problem in problems(text))


def test_one_person_with_two_names_is_refused() -> None:
    twin = replace(BOB.trusted(), name="robert")
    trust = trust_of(roots=[ALICE], roles={"maker": (["*"], [BOB])})
    (problem,) = problems(trust_text.to_text(replace(trust, keys=(*trust.keys, twin))))
    assert problem.code == "TRUST_TWICE"
    roots = replace(trust.roots, keys=(*trust.roots.keys, replace(ALICE.trusted(), name="alicia")))
    (problem,) = problems(trust_text.to_text(replace(trust, roots=roots)))
    assert problem.code == "TRUST_TWICE"


CONTRADICTIONS = {
    "a key that ends before it begins": (
        replace(FULL, keys=(BOB.trusted(MADE, MADE), TOKEN.trusted())),
        "TRUST_VALUE",
        "ends before it begins",
    ),
    "a role without payloads": (
        replace(FULL, roles=(*FULL.roles[:1], replace(FULL.roles[1], payloads=()))),
        "TRUST_VALUE",
        "payloads: is missing or empty",
    ),
    "bounds that nothing is within": (
        replace(FULL, bounds=(Bounds("org.example.lamp", 9, 3),)),
        "TRUST_VALUE",
        "above `most`",
    ),
    "two roots of one name": (
        replace(FULL, roots=Roots((ALICE.trusted(), replace(TOKEN.trusted(), name="alice")), 2)),
        "TRUST_TWICE",
        "root 'alice' stands twice",
    ),
    "two keys of one name": (
        replace(FULL, keys=(*FULL.keys, replace(Key("carol").trusted(), name="bob"))),
        "TRUST_TWICE",
        "key 'bob' stands twice",
    ),
    "two roles of one name": (
        replace(FULL, roles=(*FULL.roles, FULL.roles[0])),
        "TRUST_TWICE",
        "role 'maker' stands twice",
    ),
    "two bounds for one payload": (
        replace(FULL, bounds=(Bounds("org.example.lamp", 3, 9), Bounds("org.example.lamp", 5))),
        "TRUST_TWICE",
        "bound for releases of 'org.example.lamp' stands twice",
    ),
    "two revocations of one key": (
        replace(FULL, revoked=FULL.revoked * 2),
        "TRUST_TWICE",
        "revocation of",
    ),
}


@pytest.mark.parametrize(("trust", "code", "told"), CONTRADICTIONS.values(), ids=CONTRADICTIONS)
def test_what_contradicts_itself_is_refused(trust: Trust, code: str, told: str) -> None:
    found = problems(trust_text.to_text(trust))
    assert [problem.code for problem in found] == [code], found
    assert told in found[0].message


def test_a_key_in_a_file_and_in_a_token_is_one_key() -> None:
    trust = trust_of(roots=[Key("token"), TOKEN])
    codes = {problem.code for problem in problems(trust_text.to_text(trust))}
    assert codes == {"TRUST_TWICE"}


def test_a_root_that_is_revoked_is_no_root() -> None:
    trust = trust_of(roots=[ALICE])
    gone = replace(trust, revoked=(Revocation(ALICE.public.fingerprint),))
    (problem,) = problems(trust_text.to_text(gone))
    assert "revoked" in problem.message


BOMBS = {
    "deep": "a = " + "[" * 3000,
    "dotted": "a" + ".a" * 5000 + " = 1",
    "a long number": f"version = {'9' * 5000}",
    "long": f"# {'x' * trust_file.MAX_BYTES}",
    "control characters": PLAIN.replace("maker", "ma\x1bker"),
}


@pytest.mark.parametrize("text", BOMBS.values(), ids=BOMBS)
def test_bombs_are_refused(text: str) -> None:
    assert problems(text)


def test_bytes_that_are_no_text_are_refused() -> None:
    with pytest.raises(TrustRefused) as refused:
        trust_file.parse_bytes(b"\xff" + PLAIN.encode(), "trust.toml")
    assert refused.value.code == "NOT_UTF8"


@given(st.text(max_size=60), st.integers(0, len(PLAIN)), st.integers(0, 40))
def test_noise_is_refused_and_nothing_else_raised(noise: str, place: int, cut: int) -> None:
    try:
        trust_file.parse(PLAIN[:place] + noise + PLAIN[place + cut :], "trust.toml")
    except TrustRefused as refused:
        assert refused.problems
