"""The components that planning knows, as plugins of the host's own pluggy manager.

Describing hooks answer at once, from what the plugin said when it was started or, for a component
of a peer, what the peer offers. Acting hooks give awaitables, which come to None where the
component does not answer; only that of `translate_goal` raises `NondumError` then, since a person
asked. Each answer says which component gave it.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Generic, TypeAlias, TypeVar

import pluggy

from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.peer import PeerComponent
from nondum.host.core.records.snapshot import Snapshot
from nondum.planning.merge.contribution import Contribution
from nondum.sdk import hooks
from nondum.sdk.description import (
    Behaviour,
    Condition,
    DeviceNeed,
    Fragment,
    Label,
    Phrase,
    Unit,
)
from nondum.sdk.errors import NondumError
from nondum.sdk.frozen import frozen
from nondum.sdk.hooks import hookimpl

Answer: TypeAlias = Awaitable[Mapping[str, Any] | None]
Ask: TypeAlias = Callable[[str, str, Mapping[str, Any]], Answer]
"""Asks the worker of a component for a hook: component, hook, its arguments. What it gives raises
`NondumError` where the hook fails."""
Translations: TypeAlias = Mapping[str, Mapping[str, Any]]
"""Component → what it makes of words."""
Answers: TypeAlias = dict[str, Awaitable[Translations]]
"""Component or peer that was asked → its answers, which raise `NondumError` where it has failed."""
_T = TypeVar("_T")

log = logging.getLogger(__name__)


@frozen
class Said(Generic[_T]):
    """What one component answers."""

    component: str
    value: _T


async def no_answer(component: str, hook: str, body: Mapping[str, Any]) -> None:
    """Where no worker runs."""


class ComponentPlugin:
    """One component, as the manager knows it."""

    def __init__(self, host: str, component: ComponentRecord | PeerComponent, ask: Ask) -> None:
        self.host = host
        self.component = component
        self._ask = ask

    @hookimpl
    def describe(self) -> Said[Mapping[str, str]]:
        """What the plugin is."""
        description = self.component.description
        summary = {"name": description.name, "version": description.version}
        return Said(self.component.id, summary | {"summary": description.summary})

    @hookimpl
    def behaviours(self) -> Said[tuple[Behaviour, ...]]:
        """What it can do."""
        return Said(self.component.id, self.component.description.behaviours)

    @hookimpl
    def conditions(self) -> Said[tuple[Condition, ...]]:
        """What it can tell."""
        return Said(self.component.id, self.component.description.conditions)

    @hookimpl
    def fragments(self) -> Said[tuple[Fragment, ...]]:
        """Its PDDL."""
        return Said(self.component.id, self.component.description.fragments)

    @hookimpl
    def units(self) -> Said[tuple[Unit, ...]]:
        """What it acts with."""
        return Said(self.component.id, self.component.description.units)

    @hookimpl
    def devices(self) -> Said[tuple[DeviceNeed, ...]]:
        """What it opens."""
        return Said(self.component.id, self.component.description.devices)

    @hookimpl
    def phrases(self) -> Said[tuple[Phrase, ...]]:
        """How people ask for what it does."""
        return Said(self.component.id, self.component.description.phrases)

    @hookimpl
    def labels(self) -> Said[tuple[Label, ...]]:
        """How people call what it brings."""
        return Said(self.component.id, self.component.description.labels)

    @hookimpl
    def translate_goal(self, words: str, vocabulary: Mapping[str, Any]) -> Said[Answer]:
        """Have it translate what a person said, with the words that are known now."""
        body = {"words": words, "vocabulary": vocabulary}
        return Said(self.component.id, self._ask(self.component.id, "translate_goal", body))

    @hookimpl
    def speak(self, text: str) -> Said[Answer]:
        """Have it say something."""
        return self._asked("speak", {"text": text})

    @hookimpl
    def listen(self) -> Said[Answer]:
        """Have it wait for a person's words."""
        return self._asked("listen", {})

    @hookimpl
    def learn_words(self, vocabulary: Mapping[str, Any]) -> Said[Answer]:
        """Have it learn what can be said now."""
        return self._asked("learn_words", {"vocabulary": vocabulary})

    def _asked(self, hook: str, body: Mapping[str, Any]) -> Said[Answer]:
        return Said(self.component.id, self._answered(hook, body))

    async def _answered(self, hook: str, body: Mapping[str, Any]) -> Mapping[str, Any] | None:
        try:
            return await self._ask(self.component.id, hook, body)
        except NondumError as error:
            log.warning("%s does not answer %s: %s", self.component.id, hook, error)
            return None


class ComponentPlugins:
    """The components of one snapshot after another, registered in one manager."""

    def __init__(self, ask: Ask = no_answer) -> None:
        self.manager = pluggy.PluginManager(hooks.PROJECT)
        self.manager.add_hookspecs(hooks)
        self._ask = ask
        self._names: tuple[str, ...] = ()
        """Of the components, this host's own first."""

    @property
    def hook(self) -> pluggy.HookRelay:
        """The hooks of all components. Acting ones take `ctx=None`."""
        return self.manager.hook

    def see(self, snapshot: Snapshot) -> None:
        """Register what has come, and unregister what has gone or is another one now."""
        here = {component.id: (host, component) for host, component in snapshot.everyone()}
        self._names = tuple(here)
        for name, _ in self.manager.list_name_plugin():
            plugin = self.plugin(name)
            if plugin is None or here.get(name) != (plugin.host, plugin.component):
                self.manager.unregister(name=name)
        for name, (host, component) in here.items():
            if not self.manager.has_plugin(name):
                self.manager.register(ComponentPlugin(host, component, self._ask), name)

    def plugin(self, component: str) -> ComponentPlugin | None:
        """One of them."""
        found = self.manager.get_plugin(component)
        return found if isinstance(found, ComponentPlugin) else None

    def translations(self, words: str, vocabulary: Mapping[str, Any]) -> Answers:
        """Ask every component of this host to translate what a person said."""
        plugins = self.manager.get_plugins()
        peers = [one for one in plugins if isinstance(one.component, PeerComponent)]
        translate = self.manager.subset_hook_caller("translate_goal", peers)
        said: list[Said[Answer]] = translate(ctx=None, words=words, vocabulary=vocabulary)
        return {one.component: _translation(one) for one in said}

    def contributions(self) -> tuple[Contribution, ...]:
        """What each component brings to planning, as the hooks say."""
        said = {hook: self._said(hook) for hook in _DESCRIBING}
        return tuple(
            Contribution.of(
                host=plugin.host,
                component=plugin.component.id,
                rank=plugin.component.rank,
                **{hook: answers[plugin.component.id] for hook, answers in said.items()},
            )
            for plugin in map(self.plugin, self._names)
            if plugin is not None
        )

    def _said(self, hook: str) -> dict[str, Any]:
        answers: list[Said[Any]] = getattr(self.hook, hook)()
        return {answer.component: answer.value for answer in answers}


async def _translation(said: Said[Answer]) -> Translations:
    answer = await said.value
    return {said.component: answer} if answer else {}


_DESCRIBING = ("describe", "fragments", "units", "behaviours", "phrases", "labels")
