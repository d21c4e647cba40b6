"""What is hinted at stays bounded, and what matters stays."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, invariant, rule
from tests.kit.examples import a_share

from nondum.transport.discovery import Hint, Source
from nondum.transport.discovery.hint import MAX_ADDRESSES
from nondum.transport.discovery.hint_table import MAX_PEERS, Change, HintTable
from nondum.transport.peers.keys import PeerKey

OWN = PeerKey("own")


def table(*preferred: str) -> HintTable:
    return HintTable(OWN, 1, lambda key: key in preferred, 0.0)


def hint(key: str, *addresses: str, source: Source = Source.MULTICAST, epoch: int = 1) -> Hint:
    return Hint(PeerKey(key), "rover", epoch, addresses or ("tcp://10.0.0.1:7410",), source)


def test_a_new_hint_is_told_and_the_same_again_is_not() -> None:
    here, rover = table(), hint("rover")
    assert here.add(rover, 0.0) == Change(told=rover)
    assert here.add(rover, 1.0) == Change()
    assert here.received[0].at_s == 1.0


def test_what_changes_is_told_again() -> None:
    here = table()
    here.add(hint("rover"), 0.0)
    restarted = hint("rover", epoch=2)
    assert here.add(restarted, 1.0) == Change(told=restarted)


def test_addresses_of_both_sources_are_told_the_given_first() -> None:
    here = table()
    here.add(hint("rover", "tcp://10.0.0.1:7410"), 0.0)
    static = hint("rover", "tcp://192.168.0.1:7410", source=Source.STATIC)
    told = here.add(static, 1.0).told
    assert told == replace(static, addresses=("tcp://192.168.0.1:7410", "tcp://10.0.0.1:7410"))


def test_a_peer_is_gone_when_nothing_hints_at_it_any_more() -> None:
    here = table()
    received, asked = hint("rover"), hint("rover", source=Source.STATIC)
    here.add(received, 0.0)
    here.add(asked, 0.0)
    assert here.remove(received.key, Source.MULTICAST).gone is None
    assert here.remove(received.key, Source.STATIC) == Change(gone=received.key)
    assert here.remove(received.key, Source.STATIC) == Change()


def test_the_own_echo_is_nothing_and_another_life_under_the_own_key_is_a_problem() -> None:
    here = table()
    assert here.add(hint("own"), 0.0) == Change()
    assert here.problem() is None
    assert here.add(hint("own", "tcp://10.0.0.9:7410", epoch=2), 0.0) == Change()
    assert here.hints == {}
    problem = here.problem()
    assert problem is not None
    assert problem.code == "IDENTITY_DUPLICATE"
    assert "tcp://10.0.0.9:7410" in problem.message


def test_without_keys_another_host_of_the_own_name_is_told_as_that() -> None:
    own = PeerKey("development:rover")
    here = HintTable(own, 1, lambda _: False, 0.0)
    here.add(Hint(own, "rover", 2, ("tcp://127.0.0.1:7411",), Source.STATIC), 0.0)
    problem = here.problem()
    assert problem is not None
    assert (problem.code, problem.where) == ("PEER_NAME_TAKEN", "rover")
    assert "key" not in problem.fix
    here.remove(own, Source.STATIC)
    assert here.problem() is None


def test_ten_thousand_invented_hosts_push_out_no_preferred_or_static_host() -> None:
    here = table("friend")
    here.add(hint("friend"), 0.0)
    here.add(hint("given", source=Source.STATIC), 0.0)
    for number in range(10_000):
        here.add(hint(f"invented-{number}"), number / 1000)
    assert len(here.hints) == MAX_PEERS
    assert {"friend", "given"} <= here.hints.keys()
    assert here.refused["HINT_CROWDED"] > 9000


def test_a_friend_gets_in_however_crowded_it_is() -> None:
    here = table("friend")
    for number in range(2 * MAX_PEERS):
        here.add(hint(f"invented-{number}"), 0.0)
    change = here.add(hint("friend"), 0.0)
    assert change.told is not None
    assert change.gone == "invented-0"  # the oldest is dropped for it


def test_a_stranger_gets_in_once_the_flood_is_over() -> None:
    here = table()
    for number in range(2 * MAX_PEERS):
        here.add(hint(f"invented-{number}"), 0.0)
    assert here.add(hint("rover"), 0.0).told is None
    assert here.add(hint("rover"), 1.0).told is not None


def test_where_everybody_matters_the_last_to_come_stays_out() -> None:
    here = HintTable(OWN, 1, lambda _: True, 0.0)
    for number in range(MAX_PEERS):
        here.add(hint(f"friend-{number}"), 0.0)
    assert here.add(hint("late"), 0.0) == Change()
    assert here.refused["HINT_CROWDED"] == 1


class HintChanges(RuleBasedStateMachine):
    """A subscriber that follows the changes knows what the table has."""

    keys = Bundle("keys")

    def __init__(self) -> None:
        super().__init__()
        self.table = table("key-0")
        self.followed: dict[PeerKey, Hint] = {}
        self.now_s = 0.0

    def follow(self, change: Change) -> None:
        if change.gone is not None:
            del self.followed[change.gone]
        if change.told is not None:
            assert self.followed.get(change.told.key) != change.told
            self.followed[change.told.key] = change.told

    @rule(target=keys, number=st.integers(0, 2000))
    def meet(self, number: int) -> PeerKey:
        return PeerKey(f"key-{number}")

    @rule(
        key=keys,
        source=st.sampled_from(Source),
        epoch=st.integers(1, 2),
        addresses=st.lists(st.integers(1, 40), min_size=1, max_size=MAX_ADDRESSES, unique=True),
    )
    def hear(self, key: PeerKey, source: Source, epoch: int, addresses: list[int]) -> None:
        places = [f"tcp://10.0.0.{number}:7410" for number in addresses]
        self.follow(self.table.add(hint(key, *places, source=source, epoch=epoch), self.now_s))

    @rule(key=keys, source=st.sampled_from(Source))
    def forget(self, key: PeerKey, source: Source) -> None:
        self.follow(self.table.remove(key, source))

    @rule(start=st.integers(0, 1000), count=st.integers(1, 600))
    def flood(self, start: int, count: int) -> None:
        for number in range(start, start + count):
            self.follow(self.table.add(hint(f"key-{number}"), self.now_s))

    @rule(seconds=st.floats(0, 60))
    def wait(self, seconds: float) -> None:
        self.now_s += seconds

    @invariant()
    def is_followed(self) -> None:
        assert self.table.hints == self.followed

    @invariant()
    def is_bounded(self) -> None:
        assert len(self.table.hints) <= MAX_PEERS
        assert all(len(one.addresses) <= MAX_ADDRESSES for one in self.table.hints.values())


TestHintChanges = HintChanges.TestCase
TestHintChanges.settings = settings(a_share(4), stateful_step_count=20)
