"""Where Fast Downward is: in a wheel of somebody else's, of which nothing is imported."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.machinery import PathFinder
from pathlib import Path

_LAMA_FIRST = (
    "--search",
    "let(hlm, eval_modify_costs(landmark_sum(lm_factory=lm_reasonable_orders_hps(lm_rhw()),"
    "pref=false), cost_type=one), let(hff, eval_modify_costs(ff(), cost_type=one),"
    "lazy_greedy([hff,hlm], preferred=[hff,hlm], cost_type=one, reopen_closed=false)))",
)
_WITHOUT_ORDERS = (
    "--evaluator",
    "hlm=lmcount(lm_factory=lm_rhw(),transform=adapt_costs(one),pref=false)",
    "--evaluator",
    "hff=ff(transform=adapt_costs(one))",
    "--search",
    "lazy_greedy([hff,hlm],preferred=[hff,hlm],cost_type=one,reopen_closed=false)",
)
"""For kstar-planner's build of an older version, which crashes on reasonable orders."""


@dataclass(frozen=True, slots=True)
class Engine:
    """One build: how its two programs are run."""

    translate: tuple[str, ...]
    """The translator; domain and problem follow."""
    search: tuple[str, ...]
    """The search; it reads what the translator wrote."""
    plan: str = "plan"
    """Where the search writes a plan that it is to call `plan`."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """Variables that they need besides."""


def find_engine() -> Engine | None:
    """The engine of an installed wheel: up-fast-downward's, else kstar-planner's."""
    return _of_up_fast_downward() or _of_kstar_planner()


def _of_up_fast_downward() -> Engine | None:
    builds = _folder("up_fast_downward", "downward", "builds", "release", "bin")
    if builds is None:
        return None
    return Engine(
        translate=(sys.executable, "-P", "-m", "fast_downward.translate"),
        search=(str(builds / "downward"), *_LAMA_FIRST),
        environment={"PYTHONPATH": str(builds)},
    )


def _of_kstar_planner() -> Engine | None:
    builds = _folder("kstar_planner", "builds", "release", "bin")
    if builds is None:
        return None
    return Engine(
        translate=(sys.executable, str(builds / "translate" / "translate.py")),
        search=(str(builds / "downward"), *_WITHOUT_ORDERS),
        plan="found_plans/plan",
    )


def _folder(package: str, *inside: str) -> Path | None:
    """The folder in a package that has the program, found without importing the package."""
    spec = PathFinder.find_spec(package)
    places = spec.submodule_search_locations if spec else None
    folder = Path(next(iter(places)), *inside) if places else None
    return folder if folder and (folder / "downward").is_file() else None
