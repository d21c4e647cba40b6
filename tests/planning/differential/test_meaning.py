"""Ground tasks mean what their PDDL means: the same states, steps and plans."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import given
from tests.planning.differential.generated import texts
from tests.planning.differential.semantics import Problem, State, distance, reachable
from tests.planning.differential.states import Graph, all_that_can_be_done, small
from tests.planning.differential.texts import TEXTS, Text, text

from nondum.planning.ground.ground import ground
from nondum.planning.ground.pddl_text import pddl_text
from nondum.planning.ground.progression import progress, start
from nondum.planning.pddl.facts import is_twin, twin
from nondum.planning.search import solve
from nondum.planning.search.validate import validate
from nondum.sdk.planner import AlreadyTrue, GroundTask, Plan, Unsolvable
from nondum_pddl_workbench.rehearsal import rehearsed
from nondum_pddl_workbench.standalone import load


def graph_of(problem: Problem, task: GroundTask) -> Graph:
    """The states of a ground task, as sets of atoms, with their successors."""
    basic = {declared.name for declared in problem.domain.predicates}
    basic -= {rule.name for rule in problem.domain.derived}
    unsaid = problem.start - {tuple(text.split(" ")) for text in task.facts}

    def state_of(state: frozenset[int]) -> State:
        atoms = (tuple(task.facts[number].split(" ")) for number in state)
        return unsaid | {atom for atom in atoms if atom[0] in basic}

    found: dict[State, frozenset[tuple[str, State]]] = {}
    waiting = [start(task)]
    while waiting:
        state = waiting.pop()
        if (key := state_of(state)) in found:
            continue
        check_twins(task, state)
        check_derived(problem, task, state, key)
        possible = [a for a in task.actions if a.precondition <= state]
        after = [(action.name, progress(task, state, action)) for action in possible]
        found[key] = frozenset((name, state_of(state)) for name, state in after)
        waiting += (state for _, state in after)
    return found


def check_twins(task: GroundTask, state: frozenset[int]) -> None:
    """A twin holds exactly where its fact does not."""
    number = {fact: index for index, fact in enumerate(task.facts)}
    for fact, index in number.items():
        if is_twin(fact):
            assert (index in state) != (
                number[twin(fact)] in state if twin(fact) in number else False
            ), fact


def check_derived(problem: Problem, task: GroundTask, state: frozenset[int], basic: State) -> None:
    """A derived fact holds exactly where its rules say so."""
    derived = {rule.name for rule in problem.domain.derived}
    whole = problem.settled(basic)
    for index, fact in enumerate(task.facts):
        atom = tuple(fact.split(" "))
        if atom[0] in derived:
            assert (index in state) == (atom in whole), fact


def shortest(task: GroundTask) -> int | None:
    seen, frontier, length = {start(task)}, [start(task)], 0
    while frontier:
        if any(task.goal <= state for state in frontier):
            return length
        after = {
            progress(task, state, action)
            for state in frontier
            for action in task.actions
            if action.precondition <= state
        }
        frontier, length = list(after - seen), length + 1
        seen |= after
    return None


def check(text: Text, graph: Graph) -> None:
    """Everything that must be so of a text and what is made of it."""
    problem, loaded = Problem.of(text), text.load()
    length = distance(problem, graph)
    for closed in (True, False):
        merged = replace(loaded.merged, is_closed=closed)
        assert graph_of(problem, all_that_can_be_done(replace(loaded, merged=merged))) == graph
        task = ground(merged, loaded.facts, loaded.goal)
        assert shortest(task) == length
    answer = solve(task, lambda: False)
    match answer:
        case AlreadyTrue():
            assert length == 0
        case Unsolvable():
            assert length is None
        case Plan(steps, cost):
            assert length
            assert not validate(task, answer)
            names = [task.actions[step].name for step in steps]
            found = rehearsed(loaded.merged, loaded.facts, loaded.goal, names)
            assert (found.cost, found.problems) == (cost, ())
        case _:
            raise AssertionError(answer)


@pytest.mark.parametrize("text", TEXTS, ids=str)
def test_features_mean_what_they_say(text: Text) -> None:
    problem = Problem.of(text)
    if text.name != "costs":  # where an action without a cost could be taken
        check(text, reachable(problem))
        assert distance(problem, reachable(problem)) == text.shortest


@given(text=texts())
def test_whatever_is_written_means_what_it_says(text: Text) -> None:
    check(text, small(Problem.of(text)))


@given(text=texts())
def test_whatever_is_written_is_written_again(text: Text) -> None:
    loaded = text.load()
    task = pddl_text(loaded.merged, loaded.facts, loaded.goal)
    again = load(task.domain, "domain", task.problem, "problem")
    assert pddl_text(again.merged, again.facts, again.goal).domain
    written = Text("again", task.domain, task.problem, None)
    problem = Problem.of(text)
    graph = small(problem)
    made = [rule.name for rule in Problem.of(written).domain.derived]
    assert made == [rule.name for rule in problem.domain.derived]
    names = Counter(name for after in graph.values() for name, _ in after)
    others = reachable(Problem.of(written))
    assert Counter(name for after in others.values() for name, _ in after) == names
    assert distance(Problem.of(written), others) == distance(problem, graph)


@pytest.mark.parametrize("is_closed", [True, False], ids=["closed", "open"])
def test_what_follows_from_rules_is_never_just_believed(is_closed: bool) -> None:
    lamp = text(
        "lamp",
        """(:predicates (on) (lit) (done))
           (:derived (lit) (on))
           (:action go :parameters () :precondition (not (lit)) :effect (done))""",
        "(:init) (:goal (done))",
        1,
    )
    loaded = lamp.load()
    merged = replace(loaded.merged, is_closed=is_closed)
    task = ground(merged, {"lit"}, loaded.goal)
    assert isinstance(solve(task, lambda: False), Plan)
