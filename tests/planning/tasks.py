"""Small ground tasks to plan and run: the first demonstration's, and classical ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations

from nondum.sdk.planner import GroundAction, GroundTask, Plan


@dataclass(frozen=True)
class Written:
    """An action as a person writes it: facts separated by commas, a leading `-` deletes."""

    name: str
    pre: str
    eff: str


def facts(text: str) -> frozenset[str]:
    """Split facts that are written in one line."""
    return frozenset(part.strip() for part in text.split(",") if part.strip())


def ground(actions: Iterable[Written], init: str, goal: str) -> GroundTask:
    """Index everything."""
    written = [(a.name, facts(a.pre), facts(a.eff)) for a in actions]
    words = facts(init) | facts(goal)
    for _, pre, eff in written:
        words |= pre | {e.removeprefix("-") for e in eff}
    table = tuple(sorted(words))
    number = {fact: index for index, fact in enumerate(table)}

    def numbers(some: Iterable[str]) -> frozenset[int]:
        return frozenset(number[fact] for fact in some)

    return GroundTask(
        table,
        numbers(facts(init)),
        numbers(facts(goal)),
        tuple(
            GroundAction(
                name,
                numbers(pre),
                numbers(e for e in eff if not e.startswith("-")),
                numbers(e[1:] for e in eff if e.startswith("-")),
            )
            for name, pre, eff in written
        ),
    )


def plan_of(task: GroundTask, *names: str) -> Plan:
    """The plan with these steps."""
    index = {action.name: i for i, action in enumerate(task.actions)}
    return Plan(tuple(index[name] for name in names), cost=len(names))


FOLLOW_LASTING = frozenset({"cam.stream", "det.detect", "trk.track", "base.drive", "ptu.point"})


def perceive(camera: str, detector: str = "det", tracker: str = "trk") -> list[Written]:
    """Stream, detect, track and drive, wired to one camera."""
    img, dets, cmd = f"{camera}-img", f"{detector}-dets", f"{tracker}-cmd"
    return [
        Written(
            f"cam.stream {camera} {img} r",
            f"ready {camera}, free {img}",
            f"-free {img}, flowing {img}",
        ),
        Written(
            f"det.detect {detector} {img} {dets} r",
            f"ready {detector}, flowing {img}, free {dets}",
            f"-free {dets}, flowing {dets}, shows {dets} {img}",
        ),
        Written(
            f"trk.track {tracker} {dets} {cmd} r",
            f"ready {tracker}, flowing {dets}, free {cmd}",
            f"-free {cmd}, flowing {cmd}, steers {cmd} r",
        ),
        Written(
            f"base.drive base {cmd} r",
            f"ready base, idle base, steers {cmd} r",
            "-idle base, following r",
        ),
        Written(f"trk.watch {tracker} {dets} r", f"ready {tracker}, flowing {dets}", "found r"),
    ]


def ready(*units: str) -> str:
    """Facts of healthy units."""
    return ", ".join(f"ready {unit}" for unit in units)


def follow_task(goal: str = "following r") -> GroundTask:
    """One camera of two, a detector, a tracker and a base."""
    actions = {a.name: a for camera in ("cam", "thermal") for a in perceive(camera)}
    init = "free cam-img, free thermal-img, free det-dets, free trk-cmd, idle base"
    return ground(
        actions.values(), f"{init}, {ready('cam', 'thermal', 'det', 'trk', 'base')}", goal
    )


FOLLOW_PLAN = (
    "cam.stream cam cam-img r",
    "det.detect det cam-img det-dets r",
    "trk.track trk det-dets trk-cmd r",
    "base.drive base trk-cmd r",
)


def survey_task() -> GroundTask:
    """Report a person and point at a source: finishing and lasting, partly side by side."""
    actions = [
        *perceive("cam"),
        Written("rad.localise rad src r", "ready rad", "bearing src r"),
        Written(
            "ptu.point ptu src r", "ready ptu, idle ptu, bearing src r", "-idle ptu, pointing r src"
        ),
        Written("spk.report spk r", "ready spk, found r", "reported r"),
    ]
    init = "free cam-img, free det-dets, free trk-cmd, idle base, idle ptu"
    units = ready("cam", "det", "trk", "base", "rad", "ptu", "spk")
    return ground(actions, f"{init}, {units}", "reported r, pointing r src")


def gripper_task(balls: int = 2) -> GroundTask:
    """Carry balls from one room to another with one hand."""
    rooms = ("a", "b")
    names = [f"ball{i}" for i in range(balls)]
    actions = [
        Written(f"move {x} {y}", f"at {x}", f"-at {x}, at {y}") for x, y in permutations(rooms, 2)
    ]
    for ball in names:
        for room in rooms:
            actions += [
                Written(
                    f"pick {ball} {room}",
                    f"at {room}, in {ball} {room}, empty",
                    f"-in {ball} {room}, -empty, held {ball}",
                ),
                Written(
                    f"drop {ball} {room}",
                    f"at {room}, held {ball}",
                    f"-held {ball}, empty, in {ball} {room}",
                ),
            ]
    init = ", ".join(["at a", "empty", *(f"in {ball} a" for ball in names)])
    return ground(actions, init, ", ".join(f"in {ball} b" for ball in names))


def delivery_task() -> GroundTask:
    """Two trucks and two packages between three places: much that may run side by side."""
    places, trucks, packages = ("x", "y", "z"), ("t1", "t2"), ("p1", "p2")
    actions = [
        Written(f"go {t} {a} {b}", f"truck {t} {a}", f"-truck {t} {a}, truck {t} {b}")
        for t in trucks
        for a, b in permutations(places, 2)
    ]
    for p in packages:
        for t in trucks:
            for a in places:
                at = f"truck {t} {a}"
                actions += [
                    Written(f"load {p} {t} {a}", f"{at}, at {p} {a}", f"-at {p} {a}, in {p} {t}"),
                    Written(f"unload {p} {t} {a}", f"{at}, in {p} {t}", f"-in {p} {t}, at {p} {a}"),
                ]
    return ground(actions, "truck t1 x, truck t2 y, at p1 x, at p2 y", "at p1 z, at p2 x")


def search(task: GroundTask, start: frozenset[int], without: Sequence[str] = ()) -> Plan | None:
    """Breadth-first search: enough for tasks of this size, and never wrong."""
    actions = [(i, a) for i, a in enumerate(task.actions) if a.name not in without]
    parents: dict[frozenset[int], tuple[frozenset[int], int] | None] = {start: None}
    frontier = [start]
    while frontier:
        following: list[frozenset[int]] = []
        for state in frontier:
            if task.goal <= state:
                return _trace(parents, state)
            for index, action in actions:
                if action.precondition <= state:
                    reached = state - action.delete | action.add
                    if reached not in parents:
                        parents[reached] = (state, index)
                        following.append(reached)
        frontier = following
    return None


def _trace(
    parents: dict[frozenset[int], tuple[frozenset[int], int] | None], state: frozenset[int]
) -> Plan:
    steps: list[int] = []
    while (parent := parents[state]) is not None:
        state, step = parent
        steps.append(step)
    return Plan(tuple(reversed(steps)), len(steps))
