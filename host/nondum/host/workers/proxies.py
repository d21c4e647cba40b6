"""A component's plugin as the host's own pluggy manager knows it.

Describing hooks answer at once from what the worker said. Acting hooks return awaitables, to be
gathered; they never raise, and come to None where the component does not answer.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeAlias

import pluggy

from nondum.sdk import hooks
from nondum.sdk.description import (
    Behaviour,
    Condition,
    DeviceNeed,
    Fragment,
    Label,
    Phrase,
    PluginDescription,
    Unit,
)
from nondum.sdk.errors import LinkClosed, NondumError
from nondum.sdk.hooks import hookimpl

Ask: TypeAlias = Callable[[str, Mapping[str, Any]], Awaitable[dict[str, Any]]]
"""Asks a worker: verb, body."""
Answer: TypeAlias = Awaitable[Mapping[str, Any] | None]

log = logging.getLogger(__name__)


class Proxy:
    """Stands for the plugin of one running component."""

    def __init__(self, component: str, description: PluginDescription, ask: Ask) -> None:
        self.component = component
        self._description = description
        self._ask = ask

    @hookimpl
    def describe(self) -> Mapping[str, str]:
        """What the plugin is."""
        return {"summary": self._description.summary}

    @hookimpl
    def behaviours(self) -> tuple[Behaviour, ...]:
        """What it can do."""
        return self._description.behaviours

    @hookimpl
    def conditions(self) -> tuple[Condition, ...]:
        """What it can tell."""
        return self._description.conditions

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        """Its PDDL."""
        return self._description.fragments

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        """What it acts with."""
        return self._description.units

    @hookimpl
    def devices(self) -> tuple[DeviceNeed, ...]:
        """What it opens."""
        return self._description.devices

    @hookimpl
    def phrases(self) -> tuple[Phrase, ...]:
        """How people ask for what it does."""
        return self._description.phrases

    @hookimpl
    def labels(self) -> tuple[Label, ...]:
        """How people call what it brings."""
        return self._description.labels

    @hookimpl
    def start(self) -> Answer:
        """Have the plugin get ready."""
        return self._answer("start", {})

    @hookimpl
    def stop(self) -> Answer:
        """Have the plugin leave everything safe."""
        return self._answer("stop", {})

    @hookimpl
    def translate_goal(self, words: str, vocabulary: Mapping[str, Any]) -> Answer:
        """Have it translate what a person said, with the words that are known now."""
        body = {"words": words, "vocabulary": vocabulary}
        return self._answer("translate_goal", body)

    @hookimpl
    def speak(self, text: str) -> Answer:
        """Have it say something."""
        return self._answer("speak", {"text": text})

    @hookimpl
    def listen(self) -> Answer:
        """Have it wait for a person's words."""
        return self._answer("listen", {})

    @hookimpl
    def learn_words(self, vocabulary: Mapping[str, Any]) -> Answer:
        """Have it learn what can be said now."""
        return self._answer("learn_words", {"vocabulary": vocabulary})

    async def _answer(self, verb: str, body: Mapping[str, Any]) -> Mapping[str, Any] | None:
        try:
            return await self._ask(verb, body)
        except LinkClosed:  # it has ended or was taken away, which its own events tell
            return None
        except NondumError as error:
            log.warning("%s does not answer %s: %s", self.component, verb, error)
            return None


def plugin_manager() -> pluggy.PluginManager:
    """Make a host's manager, without any plugin."""
    manager = pluggy.PluginManager(hooks.PROJECT)
    manager.add_hookspecs(hooks)
    return manager
