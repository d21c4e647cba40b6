"""The stage in which the node vanishes while a robot is steered by it."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from demo.follow_me import FollowMe
from demo.robot import Robot, View
from demo.search.searching import WORDS, own_components
from demo.search.sites import Site
from demo.stage import PLAN_S, Mark
from demo.table import StageResult
from nondum.sdk.errors import HostUnreachable

NAME = "node lost"
BRAKE_S = 3.0
"""A host counts as dead after some 1.5 s; the base brakes from full speed in less than that."""
ENDED_S = 10.0
PAUSE_S = 0.2


def lose_node(site: Site, node: Robot, following: FollowMe, others: Sequence[Robot]) -> StageResult:
    """Let the node vanish while a robot follows with what it has: the robot must halt and stand,
    the other hosts must forget the node and say what is missing, and the node must end what it did
    for them."""
    robot, mark = following.robot, Mark(node)
    pids = [row["pid"] for row in node.view["components"] if row["pid"]]
    lost = {f"{id}@{node.name}" for id in own_components(node)}
    steps = {step["component"] for step in robot.view["plan"]["steps"]}
    busy = {id.partition("@")[0] for id in steps & lost}
    result = following.bereave(
        lambda: site.lose(node), lost, name=NAME, since=site.lost, brake_s=BRAKE_S
    )
    left = [robot, *others]
    for host in left:
        host.until(f"{host.name} forgets {node.name}", without(node.name), timeout_s=PLAN_S)
    told = {host.name: missing(host) for host in left}
    faults = [
        f"{name} does not say that {node.name} is missing"
        for name, sentence in told.items()
        if f"bring the host {node.name} back" not in sentence
    ]
    if not _within(lambda: have_ended(busy, node, mark, pids), ENDED_S):
        faults.append(f"{node.name} still does something for hosts that it lost")
    names = " and ".join(told)
    measure = (
        f"{result.measure}; {names} have nothing of {node.name} any more; asked why not “{WORDS}”, "
        f"{others[0].name} says “{told[others[0].name]}”"
    )
    return dataclasses.replace(
        result,
        reached=result.reached and not faults,
        measure="; BUT ".join([measure, *faults]),
    )


def missing(host: Robot) -> str:
    """What a host says when it is asked why it cannot search: one sentence a cause."""
    found = json.loads(host.nondum("why", "--json", WORDS))
    causes = (f"{cause['message']} → {cause['fix']}" for cause in found["causes"])
    return "; ".join(causes)


def have_ended(components: Collection[str], node: Robot, mark: Mark, pids: Sequence[int]) -> bool:
    """Whether components of the node have ended what they did, by its own journal; where its daemon
    is dead, whether its workers are."""
    try:
        journal = mark.journal()
    except HostUnreachable:
        return not any(Path(f"/proc/{pid}").exists() for pid in pids)
    return {*components} <= {row["subject"] for row in journal if row["event"] == "BehaviourEnded"}


def without(name: str) -> Callable[[View], bool]:
    return lambda view: all(row["host"] != name for row in view["components"])


def _within(is_so: Callable[[], bool], seconds: float) -> bool:
    """Wait until something is so, and say whether it was in time."""
    deadline_s = time.monotonic() + seconds
    while not (found := is_so()) and time.monotonic() < deadline_s:
        time.sleep(PAUSE_S)
    return found
