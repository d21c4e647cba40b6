"""The planners that are installed beside the host, as an extension."""

from __future__ import annotations

from collections.abc import Mapping

from importlib_metadata import entry_points

from nondum.host.extension.hookspecs import hookimpl

GROUP = "nondum.planners"


@hookimpl
def planners() -> Mapping[str, str]:
    """Those of the entry-point group `nondum.planners`."""
    return {entry.name: entry.value for entry in entry_points(group=GROUP)}
