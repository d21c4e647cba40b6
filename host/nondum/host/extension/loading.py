"""Finds the extensions of this host, those that ship with nondum included."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from itertools import chain
from typing import Any

import pluggy
from importlib_metadata import EntryPoint, entry_points

from nondum.host.config.host_config import HostConfig
from nondum.host.extension import hookspecs
from nondum.sdk.errors import Problem

DEFAULT_PLUGINS = (
    "nondum.host.mind.extension",
    "nondum.host.peers.extension",
    "nondum.host.people.feedback.extension",
    "nondum.host.service.extension",
)
"""The extensions that ship with nondum."""
KEYS_OF_EXTENSIONS = ("feedback.lamps", "feedback.player")
"""Keys of the configuration that none of these acts on."""

log = logging.getLogger(__name__)


class Extensions:
    """The extensions that could be loaded, and what is wrong with the others."""

    def __init__(self, installed: Iterable[EntryPoint] | None = None) -> None:
        """`installed` are entry points; None: those of the group in this environment."""
        self.manager = pluggy.PluginManager(hookspecs.PROJECT)
        self.manager.add_hookspecs(hookspecs)
        self.problems: tuple[Problem, ...] = ()
        for name in DEFAULT_PLUGINS:
            self.manager.register(import_module(name), name)
        found = entry_points(group=hookspecs.PROJECT) if installed is None else installed
        for entry in sorted(found, key=lambda entry: entry.name):
            self._add(entry)

    def asked(self, hook: str, **arguments: Any) -> Iterator[Any]:
        """What all extensions answer to a hook, one thing after the other, in the order of their
        names; of mappings, their pairs. One that raises an error is told, and left out.
        """
        caller = getattr(self.manager.hook, hook)
        for impl in sorted(caller.get_hookimpls(), key=lambda impl: impl.plugin_name):
            others = {plugin for plugin in self.manager.get_plugins() if plugin is not impl.plugin}
            one = self.manager.subset_hook_caller(hook, others)
            try:
                answers = [_listed(answer) for answer in one(**arguments)]
            except Exception as error:
                log.exception("extension %s, hook %s", impl.plugin_name, hook)
                self._note(impl.plugin_name, f"{hook}: {type(error).__name__}: {error}")
            else:
                yield from chain.from_iterable(answers)

    def note_missing(self, config: HostConfig) -> None:
        """Add the keys that are set and that no extension acts on to `problems`."""
        acted_on = set(self.asked("config_keys"))
        for key in KEYS_OF_EXTENSIONS:
            section, _, name = key.partition(".")
            if getattr(getattr(config, section), name) and key not in acted_on:
                text = (
                    f"[{section}] {name} has no effect: no extension that is installed acts on it"
                )
                problem = Problem("EXTENSION_MISSING", text, where=key)
                log.warning("%s", problem)
                self.problems = (*self.problems, problem)

    def _add(self, entry: EntryPoint) -> None:
        try:
            plugin = entry.load()
            self.manager.register(plugin, entry.name)
            self.manager.check_pending()
        except Exception as error:
            log.exception("extension %s", entry.name)
            if self.manager.has_plugin(entry.name):
                self.manager.unregister(name=entry.name)
            self._note(entry.name, f"{type(error).__name__}: {error}")

    def _note(self, name: str, why: str) -> None:
        text = f"the extension {name} does not work: {why}"
        self.problems = (*self.problems, Problem("EXTENSION_BROKEN", text, where=name))


def _listed(answer: Any) -> tuple[Any, ...]:
    return tuple(answer.items() if isinstance(answer, Mapping) else answer)
