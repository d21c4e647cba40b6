"""Makes the mind, with the planners that the configuration asks for."""

from __future__ import annotations

from nondum.host.assembly.base import Base
from nondum.host.mind.mind import Mind
from nondum.host.mind.planners import Planners
from nondum.host.mind.runner import Calls
from nondum.host.mind.system_tree import load_system_tree
from nondum.host.workers.workers import Workers
from nondum.planning.execute.attempts import Patience
from nondum.sdk.errors import ConfigRefused, Problem


def make_mind(base: Base, workers: Workers, calls: Calls) -> Mind:
    """Make the mind; its behaviours run by `calls`. Raises `ConfigRefused`."""
    config, planning = base.config, base.config.planning
    patience = Patience(establish_s=planning.establish_s, finish_s=planning.finish_s)
    return Mind(
        config.host.name,
        calls,
        _planners(base),
        emit=base.bus.emit,
        ask=workers.ask,
        deadline_s=planning.deadline_s,
        patience=patience,
        system_tree=load_system_tree(config.host.system_tree),
    )


def _planners(base: Base) -> Planners:
    """The planners of all extensions, or those that the configuration names.

    Raises `ConfigRefused` (CONFIG_PLANNER).
    """
    planning = base.config.planning
    found: dict[str, str] = dict(base.extensions.asked("planners"))
    wanted = planning.planners
    if unknown := [name for name in wanted if name not in found]:
        known = ", ".join(sorted(found)) or "none"
        text = f"no planner {unknown[0]!r} is installed"
        problem = Problem("CONFIG_PLANNER", text, where="planning.planners", have=known)
        raise ConfigRefused(problem)
    chosen = {name: found[name] for name in wanted or found}
    return Planners.of(
        chosen,
        memory_mb=planning.memory_mb,
        temporary=base.folders.planning,
        stays=base.forks_stay,
    )
