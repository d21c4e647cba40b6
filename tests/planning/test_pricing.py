"""Of two plans that cost the same, the one whose units come first is the cheaper."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nondum.planning.ground.pricing import at_own_cost, handicaps, priced
from nondum.planning.merge.contribution import Contribution, UnitObject
from nondum.sdk.planner import GroundAction, GroundTask, Plan


def brings(component: str, *, host: str = "rover", rank: int = 0) -> Contribution:
    unit = UnitObject("eye", f"{host}__{component}__eye", "camera")
    return Contribution(component, host, component, "1.0", rank, units=(unit,))


def test_units_of_this_host_come_before_those_of_peers() -> None:
    found = handicaps([brings("b", rank=9), brings("a", host="mule")], "rover")
    assert found["rover__b__eye"] < found["mule__a__eye"]


def test_units_of_this_host_come_in_the_order_of_rank() -> None:
    found = handicaps([brings("a", rank=2), brings("b", rank=1)], "rover")
    assert found["rover__b__eye"] < found["rover__a__eye"]


def test_order_does_not_depend_on_arrival() -> None:
    both = [brings("a", rank=2), brings("b", rank=1)]
    assert handicaps(both, "rover") == handicaps(reversed(both), "rover")


costs = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 99)), max_size=100)


@given(costs, costs)
def test_rank_of_a_component_never_outweighs_what_its_action_costs(
    one: list[tuple[int, int]], other: list[tuple[int, int]]
) -> None:
    steps = [*one, *other]
    task = GroundTask(
        facts=(),
        init=frozenset(),
        goal=frozenset(),
        actions=tuple(
            GroundAction(f"go u{i}", frozenset(), frozenset(), frozenset(), cost)
            for i, (cost, _) in enumerate(steps)
        ),
    )
    dearer = priced(task, {f"u{i}": handicap for i, (_, handicap) in enumerate(steps)})

    def cost(of: GroundTask, first: int, last: int) -> int:
        return at_own_cost(of, Plan(tuple(range(first, last)), 0)).cost

    mine, theirs = (0, len(one)), (len(one), len(steps))
    if cost(task, *mine) < cost(task, *theirs):
        assert cost(dearer, *mine) < cost(dearer, *theirs)
