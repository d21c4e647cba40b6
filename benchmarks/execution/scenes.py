"""The tasks that are carried out: each a domain and a problem of this folder, ground once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from nondum.planning.ground.ground import ground
from nondum.planning.pddl.facts import parts
from nondum.sdk.planner import GroundTask
from nondum_pddl_workbench.standalone import load

DOMAINS = Path(__file__).with_name("domains")
NAMES = ("gripper", "logistics", "blocks", "satellite", "rovers", "depot", "follow")
LASTING = {"follow": frozenset({"stream", "detect", "track", "drive", "point"})}
"""Domain → the schemas of its lasting behaviours."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A task for a simulated robot."""

    name: str
    task: GroundTask
    lasting: frozenset[str]
    exclusive: frozenset[str]
    """Units that do one thing at a time: those that can be `idle`, or else all that act."""

    @property
    def start(self) -> frozenset[str]:
        """What holds at first."""
        return frozenset(self.task.facts[fact] for fact in self.task.init)

    @property
    def goal(self) -> frozenset[str]:
        """What is wanted."""
        return frozenset(self.task.facts[fact] for fact in self.task.goal)


def scene(name: str) -> Scene:
    """Read one of `NAMES`. Raises `FragmentRefused` where its PDDL is wrong."""
    texts = [DOMAINS / f"{name}.{part}.pddl" for part in ("domain", "problem")]
    domain, problem = (text.read_text(encoding="utf-8") for text in texts)
    loaded = load(domain, texts[0].name, problem, texts[1].name)
    # Units come and go here: that they are ready is no matter of course.
    merged = replace(loaded.merged, is_closed=False)
    task = ground(merged, loaded.facts, loaded.goal)
    actors = {action.arguments[0] for action in task.actions}
    idle = {parts(fact)[1][0] for fact in task.facts if parts(fact)[0] == "idle"}
    return Scene(name, task, LASTING.get(name, frozenset()), frozenset(idle or actors))
