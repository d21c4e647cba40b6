"""Which steps of a plan must keep their order, and which lasting steps a plan cuts short."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from tests.planning.tasks import (
    FOLLOW_LASTING,
    FOLLOW_PLAN,
    Written,
    delivery_task,
    follow_task,
    ground,
    plan_of,
)

from nondum.planning.execute.partial_order import (
    GOAL,
    CausalLink,
    PartialOrder,
    bits,
    causal_links,
    partial_order,
    threats,
)
from nondum.planning.execute.step import Step, steps_of, words

DELIVERY = (
    "load p1 t1 x",
    "go t1 x z",
    "unload p1 t1 z",
    "load p2 t2 y",
    "go t2 y x",
    "unload p2 t2 x",
)


def delivery_steps() -> tuple[Step, ...]:
    task = delivery_task()
    return steps_of(task, plan_of(task, *DELIVERY), frozenset())


@given(st.frozensets(st.integers(0, 200)))
def test_bits_are_the_members_of_a_mask(members: frozenset[int]) -> None:
    assert list(bits(sum(1 << m for m in members))) == sorted(members)


def test_links_name_the_last_provider() -> None:
    task = follow_task()
    steps = steps_of(task, plan_of(task, *FOLLOW_PLAN), FOLLOW_LASTING)
    links = causal_links(steps, words(task, task.goal))
    assert CausalLink("flowing cam-img", consumer=1, provider=0) in links
    assert CausalLink("ready base", consumer=3, provider=None) in links
    assert links[-1] == CausalLink("following r", consumer=GOAL, provider=3)


def test_two_trucks_are_independent() -> None:
    steps = delivery_steps()
    order = partial_order(steps, causal_links(steps, frozenset({"at p1 z", "at p2 x"})))
    assert list(order.first_of(0b111111)) == [0, 3]
    assert order.before[2] == 0b000011
    assert order.after[3] == 0b110000


def test_order_is_kept_between_reader_and_deleter() -> None:
    task = ground([Written("read", "p", "q"), Written("take", "p", "-p, r")], "p", "q, r")
    steps = steps_of(task, plan_of(task, "read", "take"), frozenset())
    order = partial_order(steps, causal_links(steps, frozenset({"q", "r"})))
    assert order.before == (0, 0b01)


@given(st.lists(st.integers(0, 2**7 - 1), max_size=7), st.integers(0, 2**7 - 1))
def test_ends_of_a_set_are_those_that_no_other_of_it_precedes_or_follows(
    wishes: list[int], some: int
) -> None:
    before: list[int] = []
    for index, wish in enumerate(wishes):
        closed = wish & ((1 << index) - 1)
        for earlier in bits(closed):
            closed |= before[earlier]
        before.append(closed)
    after = [sum(1 << j for j, b in enumerate(before) if b >> i & 1) for i in range(len(before))]
    order, some = PartialOrder(tuple(before), tuple(after)), some & ((1 << len(before)) - 1)
    assert list(order.first_of(some)) == [i for i in bits(some) if not before[i] & some]
    assert list(order.last_of(some)) == [i for i in bits(some) if not after[i] & some]


def lasting_and_breaker(*names: str, goal: str) -> tuple[Step, ...]:
    task = ground(
        [
            Written("lamp.light l", "power", "lit"),
            Written("read r", "lit", "known"),
            Written("cut c", "power", "-power, quiet"),
        ],
        "power",
        goal,
    )
    return steps_of(task, plan_of(task, *names), frozenset({"lamp.light"}))


def test_user_of_lasting_step_comes_before_its_breaker() -> None:
    steps = lasting_and_breaker("lamp.light l", "read r", "cut c", goal="known, quiet")
    order = partial_order(steps, causal_links(steps, frozenset({"known", "quiet"})))
    assert order.before[2] == 0b011


def test_plan_that_breaks_what_it_needs_later_is_told() -> None:
    steps = lasting_and_breaker("lamp.light l", "cut c", "read r", goal="known")
    found = threats(steps, causal_links(steps, frozenset({"known"})))
    assert [(t.fact, t.breaker, t.link.consumer) for t in found] == [("power", 1, 2)]
    safe = lasting_and_breaker("lamp.light l", "read r", "cut c", goal="known")
    assert not threats(safe, causal_links(safe, frozenset({"known", "quiet"})))
