"""What components and plugins of payloads that are not at work would be called on a host. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from nondum.cli.shelf import Shelved
from nondum.planning.merge import given_names
from nondum.planning.merge.given_names import NO_NAMES, GivenNames, Words, words_of
from nondum.sdk.description import PluginDescription


@dataclass(slots=True)
class ShelfNames:
    """Names as a host would give them to payload after payload; knows what it has given already."""

    kept: dict[str, GivenNames]
    """Payload id → its names."""
    said: list[tuple[str, PluginDescription]] = field(default_factory=list)
    """Payload id, and what a plugin of it says under its name on the host."""

    @classmethod
    def of(
        cls, told: Mapping[str, Any], present: Iterable[tuple[str, str, PluginDescription]]
    ) -> ShelfNames:
        """By what a daemon tells of the names that it has given, and by its own components: payload
        id, name, and what its plugin says. What has no given name has its own."""
        names = cls({id: GivenNames(**names) for id, names in told.items()})
        for payload_id, component, description in present:
            given = names.kept.get(payload_id, NO_NAMES)
            names.kept[payload_id] = GivenNames(
                _with(given.components, component), _with(given.plugins, description.name)
            )
            names.said.append((payload_id, description))
        return names

    def called(self, payloads: Iterable[Shelved]) -> Iterator[Shelved]:
        """Payloads with their components and plugins by their names on the host."""
        return map(self._called, payloads)

    def _called(self, payload: Shelved) -> Shelved:
        kept = self.kept.get(payload.id, NO_NAMES)
        names = self._components(payload, kept)
        plugins = self._plugins(payload, kept)
        self.kept[payload.id] = GivenNames(
            {**kept.components, **names}, {**kept.plugins, **plugins}
        )
        said = {
            names[id]: replace(one, name=plugins[one.name])
            for id, one in payload.components.items()
        }
        self.said += ((payload.id, description) for description in said.values())
        return replace(payload, components=said)

    def _components(self, payload: Shelved, kept: GivenNames) -> dict[str, str]:
        taken = {
            name
            for id, given in self.kept.items()
            if id != payload.id
            for name in given.components.values()
        }
        return given_names.of_components(payload.id, payload.components, kept.components, taken)

    def _plugins(self, payload: Shelved, kept: GivenNames) -> dict[str, str]:
        others: dict[str, set[Words]] = {}
        for id, description in self.said:
            if id != payload.id:
                others.setdefault(description.name, set()).add(words_of(description))
        own = {one.name for one in payload.components.values()}
        given = given_names.plugins_of_other_payloads(self.kept, payload.id)
        return {
            name: given_names.of_plugin(
                name,
                payload.id,
                {words_of(one) for one in payload.components.values() if one.name == name},
                kept.plugins.get(name),
                others,
                given,
            )
            for name in own
        }


def _with(given: Mapping[str, str], name: str) -> Mapping[str, str]:
    return given if name in given.values() else {**given, name: name}
