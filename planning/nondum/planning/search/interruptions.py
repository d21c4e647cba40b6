"""Plans that cannot be carried out because one lasting behaviour ends another too early."""

from __future__ import annotations

from nondum.planning.execute.partial_order import causal_links, threats
from nondum.planning.execute.step import steps_of, words
from nondum.planning.ground.conditional_effects import plain
from nondum.planning.merge.domain import Merged
from nondum.sdk.errors import Problem
from nondum.sdk.planner import GroundTask, Plan


def cut_short(merged: Merged, task: GroundTask, plan: Plan) -> Problem | None:
    """What is wrong with a plan that ends a lasting behaviour before its effects are used."""
    task, plan = plain(task, plan)
    steps = steps_of(task, plan, merged.lasting())
    found = threats(steps, causal_links(steps, words(task, task.goal)))
    if not found:
        return None
    breaker, provider = steps[found[0].breaker].name, steps[found[0].link.provider or 0].name
    message = f"{breaker} ends {provider}, whose ({found[0].link.fact}) is needed after it"
    return Problem("PLAN_CUT_SHORT", message)
