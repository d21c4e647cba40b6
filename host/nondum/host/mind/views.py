"""What the mind shows of itself: plain data for the command line, the page and JSON."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Protocol

from py_trees.behaviour import Behaviour as Node

from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.host.mind import evidence, offers, short_names
from nondum.host.mind.announcements import People
from nondum.host.mind.beliefs import Beliefs
from nondum.host.mind.composition import Composition, own_objects
from nondum.host.mind.frames import implausible
from nondum.host.mind.goals import GivenGoal, GoalQueue, GoalState
from nondum.host.mind.missing_reports import Silence
from nondum.host.mind.preview import Preview, preview
from nondum.host.mind.pursued import Pursued
from nondum.host.mind.pursuit import Pursuit
from nondum.host.mind.runner import BehaviourRunner
from nondum.host.mind.tree_view import Row, TreeView
from nondum.planning.execute.plan_executive import Phase
from nondum.planning.ground.conclusions import conclusions
from nondum.planning.merge.goal import Goal
from nondum.sdk.description import Behaviour
from nondum.sdk.errors import GoalRefused, Problem


class Shown(Protocol):
    """The parts of a mind that are looked at."""

    beliefs: Beliefs
    queue: GoalQueue
    people: People
    runner: BehaviourRunner
    pursuit: Pursuit
    composition: Composition | None
    names: Mapping[str, str]
    root: Node


class Views:
    """Looks at a mind and changes nothing."""

    def __init__(
        self,
        mind: Shown,
        *,
        now_s: Callable[[], float] = time.monotonic,
        wall_s: Callable[[], float] = time.time,
    ) -> None:
        """`now_s` is the mind's own clock, `wall_s` gives seconds since 1970."""
        self._mind = mind
        self._tree = TreeView(
            queue=mind.queue,
            pursuit=mind.pursuit,
            runner=mind.runner,
            composition=lambda: mind.composition,
            now_s=now_s,
            wall_s=wall_s,
        )

    def plan(self) -> Row:
        """The most urgent goal that is pursued, and each step of its plan: `step`, `action`,
        `state`, `why`, and the last two as people are told them: `told` and `told_why`; `beside`
        has the same of goals that are pursued at the same time."""
        first, *others = [self._plan(one) for one in self._mind.pursuit.pursued] or [_NO_PLAN]
        return {**first, "beside": others}

    def _plan(self, one: Pursued) -> Row:
        goal = self._mind.queue[one.goal]
        running = {run.step.name: run for run in self._mind.runner}
        called = self._called(one)
        steps = []
        for leaf in one.tree.steps:
            run = running.get(leaf.name)
            state = run.state.value if run else _STATES[leaf.status.value]
            why = "; ".join(filter(None, (leaf.why(), run.progress if run else "")))
            row = {"step": leaf.index + 1, "action": leaf.name, "state": state, "why": why}
            row |= {"component": run.component if run else None, "told": called[leaf.name]}
            steps.append(row | {"told_why": self._told(why, called)})
        return {"goal": goal.pddl, "id": goal.id, "kind": goal.kind, "steps": steps}

    def tree(self) -> Row:
        """The whole behaviour tree as it was last ticked, see `tree_view`."""
        return self._tree.row(self._mind.root)

    def facts(self) -> list[Row]:
        """All that is believed, see `evidence.believed`."""
        users = {
            name: f"{run.component}.{run.behaviour}"
            for run in self._mind.runner
            for name in (run.step.actor, *run.streams)
        }
        return evidence.believed(self._mind.beliefs, self._mind.composition, users)

    def parked(self) -> list[Row]:
        """The facts that wait for objects, see `evidence.parked`."""
        return evidence.parked(self._mind.beliefs)

    def fact(self, text: str) -> Row:
        """One fact, true or not, and all that bears on it, see `evidence.explained`."""
        return evidence.explained(text, self._mind.beliefs, self._mind.composition)

    def given(self) -> list[Row]:
        """What was asked for; of goals that are reached, or kept up just now, `holds` is true.

        `replaces` has the goals whose place one takes: `id`, `text`, and whether that `is_over`.
        """
        return [self.goal(goal) for goal in self._mind.queue]

    def goal(self, goal: GivenGoal) -> Row:
        """One goal, in the same columns."""
        held = {one.goal for one in self._mind.pursuit.pursued if one.phase is Phase.HOLDING}
        replaces = [
            {"id": other.id, "text": other.text, "is_over": other.state.is_final}
            for other in self._mind.queue.replaces(goal.id)
        ]
        holds = goal.state is GoalState.REACHED or goal.id in held
        return {**goal.to_dict(), "holds": holds, "replaces": replaces}

    def goals(self) -> Callable[[], Row]:
        """What can be asked for now and what was, worked out by the function that is given, in any
        thread: `can` and `phrases`, see `offers`; `given`; `problems` of phrases."""
        composition, given, outlook = self._mind.composition, self.given(), self._outlook()

        def goals() -> Row:
            if composition is None:
                return {"can": [], "phrases": [], "given": given, "problems": []}
            return {
                "can": offers.offers(composition, outlook(composition)),
                "phrases": offers.phrases(composition),
                "given": given,
                "problems": [str(problem) for problem in composition.book.problems],
            }

        return goals

    def wish(self, words: str) -> Callable[[], Row]:
        """Whether words can be had as a goal now, worked out by the function that is given, in any
        thread: a row of `offers`. Raises `GoalRefused` where they mean nothing or several things.
        """
        composition, outlook = self._mind.composition, self._outlook()
        if composition is None:
            raise GoalRefused(Problem("PHRASE_UNKNOWN", f"nothing here understands {words!r}"))
        reading = composition.book.reading(words)
        return lambda: offers.offer([reading], outlook(composition), composition)

    def preview(self, goal: Goal) -> Callable[[], Preview]:
        """What would become of a goal, worked out by the function that is given, in any thread."""
        composition, outlook = self._mind.composition, self._outlook()
        bare_facts, names = self._mind.beliefs.world.bare_facts, self._mind.names
        if composition is None:
            return lambda: Preview("unknown")
        return lambda: preview(composition, goal, outlook(composition), bare_facts, names)

    def _outlook(self) -> Callable[[Composition], offers.Outlook]:
        """What can be had by what is believed now, once it is worked out."""
        world, seen = self._mind.beliefs.world, self._mind.pursuit.seen
        facts, bare_facts = world.facts, world.bare_facts

        def outlook(composition: Composition) -> offers.Outlook:
            follows = conclusions(composition.merged, facts).keys()
            return offers.Outlook(composition, facts | follows, bare_facts, tuple(seen))

        return outlook

    def why(self, away: Sequence[str] = ()) -> Row:
        """Why the robot does what it does, or cannot: `sentences` and `problems`. `away` are those
        on goals that were given to peers."""
        pursued = self._mind.pursuit.pursued
        sentences: list[str] = []
        for one in pursued:
            goal = self._mind.queue[one.goal]
            why = self._told(one.tree.why(), self._called(one))
            sentences.append(f"goal {goal.id}, {goal.text!r}: {why}")
            sentences += [f"  {row['told']}: {row['told_why']}" for row in self._plan(one)["steps"]]
        problems = []
        for goal in self._mind.queue:
            if not goal.state.is_final and goal.id not in {one.goal for one in pursued}:
                reason = self._told(goal.reason, {}) if goal.state is GoalState.QUEUED else ""
                waits = f": {reason}" if reason else ""
                sentences.append(f"goal {goal.id}, {goal.text!r}, is {goal.state.value}{waits}")
                problems += [str(problem) for problem in goal.problems]
        return {
            "sentences": [*sentences, *away] or ["nothing is asked for"],
            "problems": problems + [row["problem"] for row in self.kept_out()] + self._conflicts(),
            "told": self.told(self._last_few()),
        }

    def troubles(self) -> dict[str, str]:
        """Component → which of its actions fail again and again, and how."""
        composition = self._mind.composition
        objects = composition.merged.objects if composition else {}
        found: dict[str, list[str]] = {}
        for name, why in self._mind.pursuit.troubles.items():
            schema, _, bound = name.partition(" ")
            owner = objects.get(bound.partition(" ")[0])
            if owner is not None and owner.component:
                found.setdefault(owner.component, []).append(f"{schema} {why}")
        return {component: "; ".join(told) for component, told in found.items()}

    def composition(self) -> Row:
        """All that planning goes by, for tools that plan by themselves: `host`, `components`,
        `names` that the host has given, `facts`, `excluded` actions and why, `silence` of what is
        here, and the components `seen` here before."""
        beliefs, pursuit = self._mind.beliefs, self._mind.pursuit
        kept_out = dict(pursuit.left_out)
        return {
            "host": beliefs.snapshot.host,
            "components": [
                {
                    "component": component.id,
                    "payload": component.payload_id,
                    "host": host,
                    "rank": component.rank,
                    "description": component.description.to_dict(),
                }
                for host, component in self._everyone()
                if component.id not in kept_out
            ],
            "names": {id: asdict(names) for id, names in beliefs.snapshot.names.items()},
            "facts": sorted(beliefs.world.bare_facts),
            "excluded": pursuit.exclusions.failures,
            "silence": Silence.of(beliefs.snapshot).to_dict(),
            "seen": [
                {
                    "component": seen.contribution.component,
                    "payload": seen.payload_id,
                    "version": seen.version,
                    "host": seen.host,
                    "left": seen.left_wall_s,
                    "description": seen.description.to_dict(),
                }
                for seen in pursuit.seen
            ],
        }

    def behaviours(self) -> list[Row]:
        """What can be done: `behaviour`, `component`, `kind`, `running`, `phrases` that ask for it,
        and the `problem` that keeps its component out of planning."""
        kept_out = {row["component"]: row["problem"] for row in self.kept_out()}
        running = {(run.component, run.behaviour) for run in self._mind.runner}
        return [
            {
                "behaviour": behaviour.name,
                "component": component.id,
                "kind": "lasting" if behaviour.lasting else "finishing",
                "running": (component.id, behaviour.name) in running,
                "phrases": self._phrases(component, behaviour),
                "problem": kept_out.get(component.id, ""),
            }
            for _, component in self._everyone()
            for behaviour in component.description.behaviours
            if behaviour.name in component.abilities
        ]

    def units(self) -> list[Row]:
        """What there is to act with: `unit`, `type`, `component`, `ready`, mount and doubts."""
        rows = []
        for host, component in self._everyone():
            names = own_objects(host, component)
            for unit in component.description.units:
                pose = self._mind.beliefs.snapshot.mount(names[unit.name])
                row = {
                    "unit": names[unit.name],
                    "type": unit.type,
                    "component": component.id,
                    "ready": component.is_ready,
                    "xyz": list(pose.xyz) if pose else None,
                    "rpy": list(pose.rpy) if pose else None,
                    "mount": pose.origin if pose else "unknown",
                    "warnings": list(implausible(pose)) if pose else [],
                }
                rows.append(row)
        return rows

    def streams(self) -> list[Row]:
        """The streams and their consumers, as the running plan wires them: `stream`, `type`,
        `component`, `flowing`, `consumers`."""
        consumers: dict[str, list[str]] = {}
        for run in self._mind.runner:
            for stream in run.streams:
                consumers.setdefault(stream, []).append(run.component)
        rows = []
        for host, component in self._everyone():
            names = own_objects(host, component)
            for unit in component.description.units:
                for output in unit.outputs:
                    stream = names[output.name]
                    readers = set(consumers.get(stream, [])) - {component.id}
                    row: Row = {"stream": stream, "type": output.type, "component": component.id}
                    row |= {"flowing": stream in self._mind.beliefs.flowing}
                    rows.append(row | {"consumers": sorted(readers)})
        return rows

    def told(self, since: int = 0) -> list[Row]:
        """What people were told after the sentence of that number."""
        return [told.to_dict() for told in self._mind.people.since(since)]

    def _phrases(
        self, component: ComponentRecord | PeerComponent, behaviour: Behaviour
    ) -> list[str]:
        """The phrases of a behaviour, and those of whatever plugin that ask for what it does."""
        composition = self._mind.composition
        if composition is None or component.id in composition.merged.quarantined:
            return list(behaviour.phrases)
        does = {
            atom.predicate
            for action in composition.merged.domain.actions.values()
            if (action.plugin, action.behaviour) == (component.description.name, behaviour.name)
            for atom in action.effect.added()
        }
        asked = (
            phrase.pattern
            for phrase in composition.book.phrases
            if does & {atom.predicate for atom in phrase.condition.positive}
        )
        return list(dict.fromkeys([*behaviour.phrases, *asked]))

    def _called(self, one: Pursued) -> Mapping[str, str]:
        """What the steps of a plan are called."""
        return short_names.steps((leaf.name for leaf in one.tree.steps), self._mind.names)

    def _told(self, text: str, called: Mapping[str, str]) -> str:
        return short_names.told(text, called, self._mind.names)

    def _everyone(self) -> Iterator[tuple[str, ComponentRecord | PeerComponent]]:
        return self._mind.beliefs.snapshot.everyone()

    def _last_few(self) -> int:
        return max(0, self._mind.people.last_number - 5)

    def kept_out(self) -> list[Row]:
        """The components that are not planned with: `component`, `problem`."""
        composition = self._mind.composition
        found = composition.merged.quarantined.items() if composition else ()
        rows = [(name, problem) for name, problems in found for problem in problems]
        rows += self._mind.pursuit.left_out
        return [{"component": name, "problem": str(problem)} for name, problem in rows]

    def _conflicts(self) -> list[str]:
        return [str(problem) for problem in self._mind.beliefs.world.conflicts()]


_NO_PLAN: Row = {"goal": None, "kind": None, "steps": []}
_STATES = {"SUCCESS": "done", "RUNNING": "running", "FAILURE": "failed", "INVALID": "to do"}
