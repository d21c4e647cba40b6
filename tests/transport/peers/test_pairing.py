"""Pairing by a code that two people compare, and an attacker between them."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from nondum.transport.peers import PeerRefused, pairing
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.pairing import (
    NONCE_BYTES,
    TRIES,
    WINDOW_S,
    Agreed,
    Ask,
    Commit,
    Message,
    Nonce,
    Pairing,
    PairingWindow,
    Role,
    Step,
    ask,
    confirm,
    receive,
)

ROVER, BASE, MALLORY = (PeerKey(name * 8) for name in ("rover", "base0", "malor"))
nonces = st.binary(min_size=NONCE_BYTES, max_size=NONCE_BYTES)


def begin(role: Role, key: PeerKey, nonce: bytes, name: str = "host") -> Pairing:
    return PairingWindow(0.0).begin(role, key, name, nonce, 0.0)[1]


def compared(nonce_a: bytes, nonce_b: bytes) -> tuple[Pairing, Pairing]:
    """Two honest hosts, as far as the code."""
    asking = begin(Role.ASKING, ROVER, nonce_a, "rover")
    answering = begin(Role.ANSWERING, BASE, nonce_b, "base")
    answering, (commit,) = receive(answering, ask(asking), ROVER, 1.0)
    asking, (nonce,) = receive(asking, commit, BASE, 1.0)
    answering, (revealed,) = receive(answering, nonce, ROVER, 1.0)
    asking, () = receive(asking, revealed, BASE, 1.0)
    return asking, answering


@given(nonces, nonces)
def test_honest_hosts_see_one_code_and_pair(nonce_a: bytes, nonce_b: bytes) -> None:
    if nonce_a == nonce_b:
        return
    asking, answering = compared(nonce_a, nonce_b)
    assert asking.code == answering.code
    assert len(asking.code.replace(" ", "")) == 6
    asking, (yes,) = confirm(asking, 60.0)
    answering, () = receive(answering, yes, ROVER, 60.0)
    assert answering.step is Step.COMPARING
    answering, (yes,) = confirm(answering, 90.0)
    asking, () = receive(asking, yes, BASE, 90.0)
    assert (asking.step, answering.step) == (Step.PAIRED, Step.PAIRED)
    assert (asking.peer_key, asking.peer_name) == (BASE, "base")
    assert (answering.peer_key, answering.peer_name) == (ROVER, "rover")


def in_the_middle(rng: random.Random) -> bool:
    """Mallory between both, with her own key to each; whether the codes come out equal.

    She does best by finishing one side first and guessing on the other: towards the rover she is
    bound by her commitment before she sees its nonce, and the base is bound by its own.
    """
    rover = begin(Role.ASKING, ROVER, rng.randbytes(NONCE_BYTES), "rover")
    base = begin(Role.ANSWERING, BASE, rng.randbytes(NONCE_BYTES), "base")
    to_rover = begin(Role.ANSWERING, MALLORY, rng.randbytes(NONCE_BYTES), "base")
    to_base = begin(Role.ASKING, MALLORY, rng.randbytes(NONCE_BYTES), "rover")
    to_rover, (commit,) = receive(to_rover, ask(rover), ROVER, 1.0)
    rover, (nonce,) = receive(rover, commit, MALLORY, 1.0)
    to_rover, (revealed,) = receive(to_rover, nonce, ROVER, 1.0)
    rover, () = receive(rover, revealed, MALLORY, 1.0)
    base, (commit,) = receive(base, ask(to_base), MALLORY, 1.0)
    to_base, (nonce,) = receive(to_base, commit, BASE, 1.0)
    base, (revealed,) = receive(base, nonce, MALLORY, 1.0)
    return rover.code == base.code


def test_swapped_keys_go_unnoticed_as_rarely_as_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """With two digits instead of six, so that it can be counted: one in a hundred."""
    monkeypatch.setattr(pairing, "CODE_DIGITS", 2)
    rng = random.Random(1)
    unnoticed = sum(in_the_middle(rng) for _ in range(5000))
    assert 25 <= unnoticed <= 85  # 50 expected, five standard deviations


def test_swapped_keys_are_noticed_with_six_digits() -> None:
    rng = random.Random(2)
    assert not any(in_the_middle(rng) for _ in range(500))


@given(nonces, nonces, nonces)
def test_nonce_found_after_the_other_is_known_breaks_the_promise(
    ours: bytes, promised: bytes, better: bytes
) -> None:
    if promised == better or ours in (promised, better):
        return
    asking = begin(Role.ASKING, ROVER, ours)
    mallory = begin(Role.ANSWERING, MALLORY, promised)
    mallory, (commit,) = receive(mallory, ask(asking), ROVER, 1.0)
    asking, _ = receive(asking, commit, MALLORY, 1.0)
    with pytest.raises(PeerRefused, match="PAIRING_COMMITMENT"):
        receive(asking, Nonce(better), MALLORY, 1.0)


def test_key_that_was_not_proved_is_refused() -> None:
    answering = begin(Role.ANSWERING, BASE, b"n" * NONCE_BYTES)
    with pytest.raises(PeerRefused, match="PAIRING_KEY"):
        receive(answering, Ask(ROVER, "rover"), MALLORY, 1.0)


def test_third_host_cannot_speak_in_between() -> None:
    asking, _ = compared(b"a" * NONCE_BYTES, b"b" * NONCE_BYTES)
    with pytest.raises(PeerRefused, match="PAIRING_KEY"):
        receive(asking, Agreed(b""), MALLORY, 1.0)


def test_agreement_of_another_try_is_refused() -> None:
    old, _ = compared(b"c" * NONCE_BYTES, b"d" * NONCE_BYTES)
    _, (replayed,) = confirm(old, 1.0)
    _, answering = compared(b"a" * NONCE_BYTES, b"b" * NONCE_BYTES)
    with pytest.raises(PeerRefused, match="PAIRING_PROOF"):
        receive(answering, replayed, ROVER, 2.0)


def test_own_agreement_sent_back_is_refused() -> None:
    asking, _ = compared(b"a" * NONCE_BYTES, b"b" * NONCE_BYTES)
    asking, (mine,) = confirm(asking, 1.0)
    with pytest.raises(PeerRefused, match="PAIRING_PROOF"):
        receive(asking, mine, BASE, 1.0)


def test_own_nonce_sent_back_is_refused() -> None:
    answering = begin(Role.ANSWERING, BASE, b"n" * NONCE_BYTES)
    answering, _ = receive(answering, Ask(ROVER, "rover"), ROVER, 1.0)
    with pytest.raises(PeerRefused, match="PAIRING_COMMITMENT"):
        receive(answering, Nonce(b"n" * NONCE_BYTES), ROVER, 1.0)


def test_answer_after_two_minutes_is_refused() -> None:
    asking, _ = compared(b"a" * NONCE_BYTES, b"b" * NONCE_BYTES)
    with pytest.raises(PeerRefused, match="PAIRING_OVER"):
        confirm(asking, WINDOW_S + 0.1)
    with pytest.raises(PeerRefused, match="PAIRING_OVER"):
        receive(asking, Agreed(b""), BASE, WINDOW_S + 0.1)


def test_try_begins_within_the_window_and_with_a_whole_nonce() -> None:
    window = PairingWindow(0.0)
    with pytest.raises(PeerRefused, match="PAIRING_OVER"):
        window.begin(Role.ASKING, ROVER, "rover", b"n" * NONCE_BYTES, WINDOW_S + 0.1)
    with pytest.raises(ValueError, match="nonce"):
        window.begin(Role.ASKING, ROVER, "rover", b"n" * (NONCE_BYTES - 1), 1.0)


def test_nonce_of_another_length_is_refused() -> None:
    answering = begin(Role.ANSWERING, BASE, b"n" * NONCE_BYTES)
    answering, _ = receive(answering, Ask(ROVER, "rover"), ROVER, 1.0)
    with pytest.raises(PeerRefused, match="PAIRING_COMMITMENT"):
        receive(answering, Nonce(b"a" * (NONCE_BYTES - 1)), ROVER, 1.0)


def test_own_key_is_refused_from_another_host() -> None:
    answering = begin(Role.ANSWERING, BASE, b"n" * NONCE_BYTES)
    with pytest.raises(PeerRefused, match="PAIRING_KEY"):
        receive(answering, Ask(BASE, "rover"), BASE, 1.0)


def test_fourth_try_is_refused() -> None:
    window = PairingWindow(0.0)
    for _ in range(TRIES):
        window, _ = window.begin(Role.ASKING, ROVER, "rover", b"n" * NONCE_BYTES, 1.0)
    with pytest.raises(PeerRefused, match="PAIRING_TRIES"):
        window.begin(Role.ASKING, ROVER, "rover", b"n" * NONCE_BYTES, 1.0)


def test_code_is_not_known_before_both_nonces_are() -> None:
    with pytest.raises(ValueError, match="no code yet"):
        _ = begin(Role.ASKING, ROVER, b"n" * NONCE_BYTES).code


def test_nothing_is_taken_after_a_person_said_no() -> None:
    asking, _ = compared(b"a" * NONCE_BYTES, b"b" * NONCE_BYTES)
    with pytest.raises(PeerRefused, match="PAIRING_ORDER"):
        confirm(pairing.failed(asking), 1.0)


class Disorder(RuleBasedStateMachine):
    """Whatever comes, in whatever order: no host is paired without both people's yes."""

    def __init__(self) -> None:
        super().__init__()
        asking, answering = compared(b"a" * NONCE_BYTES, b"b" * NONCE_BYTES)
        self.real: list[Message] = [
            ask(begin(Role.ASKING, ROVER, b"a" * NONCE_BYTES, "rover")),
            Commit(BASE, "base", asking.commitment),
            Nonce(b"a" * NONCE_BYTES),
            Nonce(b"b" * NONCE_BYTES),
        ]
        self.theirs = answering
        self.ours = begin(Role.ASKING, ROVER, b"a" * NONCE_BYTES, "rover")
        self.now_s = 0.0
        self.confirmed_here = self.confirmed_there = False

    @rule(which=st.integers(0, 3), proved=st.sampled_from([BASE, ROVER, MALLORY]))
    def a_message_comes(self, which: int, proved: PeerKey) -> None:
        self._take(self.real[which], proved)

    @rule(proof=st.binary(max_size=32))
    def a_forged_agreement_comes(self, proof: bytes) -> None:
        self._take(Agreed(proof), BASE)

    @rule()
    def the_person_there_agrees(self) -> None:
        _, (yes,) = confirm(replace(self.theirs, ends_s=1e9), self.now_s)
        before = self.ours.step
        self._take(yes, BASE)
        if before in (Step.COMPARING, Step.AWAITING_AGREED) and self.now_s <= WINDOW_S:
            self.confirmed_there = True

    @rule()
    def the_person_here_agrees(self) -> None:
        try:
            self.ours, _ = confirm(self.ours, self.now_s)
        except PeerRefused:
            return
        self.confirmed_here = True

    @rule(seconds=st.floats(0, 50))
    def time_passes(self, seconds: float) -> None:
        self.now_s += seconds

    @invariant()
    def paired_means_that_both_agreed(self) -> None:
        if self.ours.step is Step.PAIRED:
            assert self.confirmed_here
            assert self.confirmed_there
            assert self.ours.peer_key == BASE

    def _take(self, message: Message, proved: PeerKey) -> None:
        try:
            self.ours, _ = receive(self.ours, message, proved, self.now_s)
        except PeerRefused:
            return


TestDisorder = Disorder.TestCase
