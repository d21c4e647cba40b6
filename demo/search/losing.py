"""The stage in which the node vanishes while a robot is steered by it."""

from __future__ import annotations

from collections.abc import Sequence

from demo.follow_me import follow_me
from demo.following import Reference
from demo.robot import Robot, View
from demo.search.sites import Site
from demo.stage import PLAN_S
from demo.table import StageResult

FOLLOW = "follow me through the facility"
NAME = "node lost"
BRAKE_S = 3.0
"""A host counts as dead after some 1.5 s; the base brakes from full speed in less than that."""


def lose_node(
    site: Site, node: Robot, robot: Robot, others: Sequence[Robot], reference: Reference
) -> StageResult:
    """Have a robot follow with what the node has, and let the node vanish: the robot must halt
    and stand, all hosts must forget the node, and say what is missing."""
    robot.ask("goal", words=FOLLOW)
    robot.until(f"{NAME}: {robot.name} follows", _all_established, timeout_s=PLAN_S)
    lost = {row["component"] for row in robot.view["components"] if row["host"] == node.name}
    with follow_me(robot, reference, words=FOLLOW) as following:
        result = following.bereave(
            lambda: site.lose(node), lost, name=NAME, since="that", brake_s=BRAKE_S
        )
    return result


def _all_established(view: View) -> bool:
    states = [step["state"] for step in view["plan"]["steps"]]
    return bool(states) and all(state == "established" for state in states)
