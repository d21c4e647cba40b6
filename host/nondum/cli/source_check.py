"""Whether a payload's source folder would make a payload that hosts take: what the bench asks.

It is what `payload build` finds out before it asks an index for anything; `pyproject.toml` names it
in the group of `nondum.sdk.source_check`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from nondum.host.trust import vocabulary_check
from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.plugin import describe, load
from nondum.wheelhouse.build import source
from nondum.wheelhouse.format.manifest import ComponentManifest


def check(folder: Path) -> Sequence[Problem]:
    """What is wrong with a source folder's manifest, goals, plugins, devices, fragments and
    phrases. Its plugins are imported in this process."""
    problems: list[Problem] = []
    described: dict[str, PluginDescription] = {}
    try:
        said = source.manifest_of(folder)
        source.goals_of(folder)
    except NondumError as error:
        return error.problems
    for component in said.components:
        try:
            described[component.id] = _described(folder, component)
        except NondumError as error:
            problems += error.problems
    if problems:  # of a part of a payload nothing can be said of words that another part declares
        return problems
    return source.description_problems(
        said, described, lambda index: vocabulary_check.judge(index).problems
    )


def _described(folder: Path, component: ComponentManifest) -> PluginDescription:
    described = describe(load(source.entry_point(folder, component), component.distribution))
    declared = source.declared_version(folder, component.distribution)
    return replace(described, version=declared or described.version)
