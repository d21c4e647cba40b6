"""A plan of actions with conditional effects and derived facts as one of plain STRIPS actions.

Along a plan it is known which effects happen and why each derived fact holds. Written into the
steps' preconditions, that is enough for the plan to reach its goal by plain regression; it is not
necessary, so a world that goes another way asks for a new plan, and none is called reached wrongly.
"""

from __future__ import annotations

from dataclasses import replace

from nondum.planning.ground.progression import changes, progress, start
from nondum.planning.pddl.facts import twin
from nondum.sdk.planner import GroundAction, GroundTask, Plan, Rule

State = frozenset[int]


def plain(task: GroundTask, plan: Plan) -> tuple[GroundTask, Plan]:
    """The task of a valid plan's steps alone, and the plan in it. Its facts are all basic."""
    if not task.features:
        return task, plan
    return _Writing(task).written(plan)


class _Writing:
    def __init__(self, task: GroundTask) -> None:
        self._task = task
        self._facts = list(task.facts)
        self._number = {text: index for index, text in enumerate(task.facts)}
        self._rules: dict[int, list[Rule]] = {}
        self._complements: dict[int, int] = {}
        for layer in task.derived:
            for rule in layer.rules:
                self._rules.setdefault(rule.head, []).append(rule)
            self._complements |= {other: fact for fact, other in layer.complements}

    def written(self, plan: Plan) -> tuple[GroundTask, Plan]:
        taken = [self._task.actions[index] for index in plan.steps]
        states = [start(self._task)]
        for action in taken:
            states.append(progress(self._task, states[-1], action))
        goal = needed = self._supports(self._task.goal, states[-1])
        steps: list[GroundAction] = []
        for action, state in zip(reversed(taken), reversed(states[:-1]), strict=True):
            step = self._with_twins(self._step(action, state, needed))
            needed = (needed - step.add) | step.precondition
            steps.append(step)
        steps = [self._with_twins(step) for step in reversed(steps)]  # of which there are more now
        added = self._facts[len(self._task.facts) :]
        true = {self._number[text] for text in added if self._number[twin(text)] not in states[0]}
        task = GroundTask(tuple(self._facts), self._task.init | true, goal, tuple(steps))
        return task, replace(plan, steps=tuple(range(len(steps))))

    def _step(self, action: GroundAction, state: State, needed: State) -> GroundAction:
        happening = [e.condition for e in action.conditional if e.condition <= state]
        conditions = action.precondition.union(*happening)
        precondition = set(self._supports(conditions, state))
        for effect in action.conditional:
            if not effect.condition <= state and effect.delete & needed:
                precondition |= self._against_all(effect.condition, state)
        add, delete = changes(action, state)
        return GroundAction(action.name, frozenset(precondition), add, delete - add, action.cost)

    def _with_twins(self, step: GroundAction) -> GroundAction:
        """A step that changes the twins, as far as there are some by now, with their facts."""
        add, delete = step.add | self._twins(step.delete), step.delete | self._twins(step.add)
        return replace(step, add=add, delete=delete)

    def _twins(self, facts: State) -> State:
        twins = (twin(self._facts[fact]) for fact in facts)
        return frozenset(self._number[text] for text in twins if text in self._number)

    def _supports(self, facts: State, state: State) -> State:
        reasons = self._reasons(state)
        found: set[int] = set()
        for fact in facts:
            found |= self._support(fact, state, reasons)
        return frozenset(found)

    def _reasons(self, state: State) -> dict[int, Rule]:
        """For each derived fact the rule that gave it first, so that reasons make no circle."""
        known = {fact for fact in state if fact not in self._rules}
        reasons: dict[int, Rule] = {}
        while True:
            new = [
                rule
                for head, rules in self._rules.items()
                if head in state and head not in known
                for rule in rules
                if rule.body <= known
            ]
            if not new:
                return reasons
            for rule in new:
                reasons.setdefault(rule.head, rule)
                known.add(rule.head)

    def _support(self, fact: int, state: State, reasons: dict[int, Rule]) -> set[int]:
        """Basic facts that hold, and from which a fact follows."""
        if fact in self._complements:
            return self._against(self._complements[fact], state, set())
        if fact not in self._rules:
            return {fact}
        found: set[int] = set()
        for needed in reasons[fact].body:
            found |= self._support(needed, state, reasons)
        return found

    def _against_all(self, facts: State, state: State) -> set[int]:
        """Basic facts that hold, and with which not all of `facts` can."""
        false = sorted(facts - state, key=lambda fact: (fact in self._rules, fact))
        return self._against(false[0], state, set())

    def _against(self, fact: int, state: State, seen: set[int]) -> set[int]:
        """Basic facts that hold, and with which a fact that is false stays false."""
        if fact in self._complements:
            return set(self._support(self._complements[fact], state, self._reasons(state)))
        if fact not in self._rules:
            return {self._twin(fact)}
        seen.add(fact)
        found: set[int] = set()
        for rule in self._rules[fact]:
            false = rule.body - state
            # A rule that waits for one which is refuted already cannot come first.
            if not false & seen:
                found |= self._against(min(false, key=self._depth), state, seen)
        return found

    def _depth(self, fact: int) -> tuple[bool, int]:
        return fact in self._rules, fact

    def _twin(self, fact: int) -> int:
        text = twin(self._facts[fact])
        if text not in self._number:
            self._number[text] = len(self._facts)
            self._facts.append(text)
        return self._number[text]
