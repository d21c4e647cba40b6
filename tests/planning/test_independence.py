"""Plans that take nothing from each other may be interleaved in any way."""

from __future__ import annotations

from collections.abc import Iterable

from hypothesis import assume, given
from hypothesis import strategies as st
from tests.planning.strangers import BEACON, LAMP, ROVER, components, task

from nondum.planning.execute.independence import Reservation, conflicting, kept_clear
from nondum.planning.execute.step import Step
from nondum.planning.pddl.facts import twin
from nondum.sdk.planner import GroundAction

PLAIN = tuple("abcdef")
NOTHING: frozenset[str] = frozenset()


def holding(state: frozenset[str]) -> tuple[str, ...]:
    """All facts and twins that are so."""
    return tuple(fact if fact in state else twin(fact) for fact in PLAIN)


def after(state: frozenset[str], plan: Iterable[Step]) -> frozenset[str]:
    """The facts after a plan, each step of which can be taken."""
    for step in plan:
        assert step.precondition <= frozenset(holding(state))
        state = state - step.delete | step.add
    return state


def step(name: str, needs: frozenset[str], add: frozenset[str], delete: frozenset[str]) -> Step:
    nothing: frozenset[int] = frozenset()
    action = GroundAction(name, nothing, nothing, nothing)
    return Step(action, needs, add, delete - add, lasting=False, guard=needs - delete)


@st.composite
def plans(
    draw: st.DrawFn, unit: str, state: frozenset[str]
) -> tuple[tuple[Step, ...], frozenset[str]]:
    """A plan that can be carried out from a state, and facts that hold at its end."""
    plan: list[Step] = []
    few = st.frozensets(st.sampled_from(PLAIN), max_size=2)
    for number in range(draw(st.integers(0, 3))):
        needs = draw(st.frozensets(st.sampled_from(holding(state)), max_size=2))
        plan.append(step(f"do {unit}{number}", needs, draw(few), draw(few)))
        state = after(state, plan[-1:])
    return tuple(plan), draw(st.frozensets(st.sampled_from(holding(state)), min_size=1, max_size=2))


@given(st.data(), st.frozensets(st.sampled_from(PLAIN)))
def test_independent_plans_reach_both_goals_however_they_are_interleaved(
    data: st.DataObject, begin: frozenset[str]
) -> None:
    left, left_goal = data.draw(plans("left", begin))
    right, right_goal = data.draw(plans("right", begin))
    one = Reservation.of("1", left, left_goal, ())
    other = Reservation.of("2", right, right_goal, ())
    assert bool(one.conflict(other)) == bool(other.conflict(one))
    assume(not one.conflict(other))
    queues = [iter(left), iter(right)]
    turns = data.draw(st.permutations([0] * len(left) + [1] * len(right)))
    together = after(begin, [next(queues[turn]) for turn in turns])
    assert left_goal | right_goal <= frozenset(holding(together))


def reservation(goal: str, plugin: str, action: str) -> Reservation:
    """Of a plan of one action of a plugin of the strangers."""
    ground = task(components((BEACON, LAMP)), goal)
    found = next(one for one in ground.actions if one.schema == f"{plugin}.{action}")
    step = Step.from_action(ground, found, lasting=True)
    wanted = frozenset(ground.facts[fact] for fact in ground.goal)
    return Reservation.of(goal, (step,), wanted, ())


def test_what_both_need_is_named() -> None:
    led = f"{ROVER}__beacon__led"
    shine = reservation(f"(lit {led})", "beacon", "shine")
    flash = reservation("(reported person self)", "beacon", "flash")
    lamp = reservation(f"(lit {ROVER}__lamp__led)", "lamp", "shine")
    assert conflicting(flash, (shine, lamp)) == {shine.goal: led}


def test_unit_that_serves_one_behaviour_at_a_time_is_not_shared() -> None:
    def reserved(name: str, exclusive: tuple[str, ...]) -> Reservation:
        plan = (step(f"{name} arm", NOTHING, NOTHING, NOTHING),)
        return Reservation.of(name, plan, frozenset({name}), exclusive)

    assert reserved("lift", ("arm",)).conflict(reserved("turn", ("arm",))) == "arm"
    assert not reserved("lift", ()).conflict(reserved("turn", ()))


def test_narrowed_task_has_only_actions_that_may_be_under_way_beside_the_reserved_ones() -> None:
    led = f"{ROVER}__beacon__led"
    ground = task(components((BEACON, LAMP)), f"(and (lit {led}) (lit {ROVER}__lamp__led))")
    flash = reservation("(reported person self)", "beacon", "flash")
    left = kept_clear(ground, (flash,), ())
    assert {action.schema for action in left.actions} == {"lamp.shine"}
    assert len(ground.actions) > 1
