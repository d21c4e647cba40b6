"""Which name becomes which: one answer for all packages, by what the name stands for."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from demo.shuffle import pddl
from demo.shuffle.package import Package, Table
from demo.shuffle.pddl import Part
from demo.shuffle.vocabulary import Core, declared, spoken
from demo.shuffle.words import Words

_SLOT_TYPE = re.compile(r"(\{\s*[\w-]+\s*:\s*)([\w-]+)")


@dataclass(frozen=True, slots=True)
class Names:
    """Old name → new name, in tables by what it names."""

    core: Core
    distributions: Mapping[str, str]
    packages: Mapping[str, str]
    payloads: Mapping[str, str]
    components: Mapping[str, str]
    entry_points: Mapping[str, str]
    files: Mapping[str, str]
    """File names of fragments."""
    domains: Mapping[str, str]
    actions: Mapping[str, str]
    words: Mapping[str, str]
    """Units, slots, inputs, devices, behaviours, conditions; objects, types and predicates."""

    def part(self, part: Part, name: str) -> str:
        """The new name of what plays a part in PDDL; the core's words stay."""
        if self.core.has(part, name):
            return name
        tables = {Part.DOMAIN: self.domains, Part.ACTION: self.actions}
        return tables.get(part, self.words)[name]

    def type(self, name: str) -> str:
        """The new name of a type."""
        return self.part(Part.TYPE, name)

    def fragment(self, text: str) -> str:
        """A domain or problem in the new names."""
        return pddl.renamed(text, pddl.fragment(text), self.part)

    def formula(self, text: str) -> str:
        """A goal in the new names."""
        return pddl.renamed(text, pddl.formula(text), self.part)

    def signature(self, text: str) -> str:
        """An action's signature in the new names."""
        return pddl.renamed(text, pddl.signature(text), self.part)

    def pattern(self, text: str) -> str:
        """A phrase's pattern: its words stay, only own types of slots have new names."""
        return _SLOT_TYPE.sub(lambda slot: slot[1] + self._slot_type(slot[2]), text)

    def description(self, said: Table) -> Table:
        """What a plugin will say about itself when it has been renamed."""
        return said | {
            "name": self.distributions[said["name"]],
            "behaviours": [self._behaviour(entry) for entry in said["behaviours"]],
            "conditions": [self._condition(entry) for entry in said["conditions"]],
            "fragments": [
                {"name": self.files[f["name"]], "text": self.fragment(f["text"])}
                for f in said["fragments"]
            ],
            "units": [self._unit(unit) for unit in said["units"]],
            "devices": [
                device | {"name": self.words[device["name"]]} for device in said["devices"]
            ],
            "phrases": [
                p | {"pattern": self.pattern(p["pattern"]), "goal": self.formula(p["goal"])}
                for p in said["phrases"]
            ],
            "labels": [
                label | {"object": self.part(Part.OBJECT, label["object"])}
                for label in said["labels"]
            ],
        }

    def _behaviour(self, said: Table) -> Table:
        return said | {
            "name": self.words[said["name"]],
            "action": self.signature(said["action"]),
            "phrases": [self.pattern(pattern) for pattern in said["phrases"]],
        }

    def _condition(self, said: Table) -> Table:
        predicates = [self.part(Part.PREDICATE, name) for name in said["predicates"]]
        return said | {"name": self.words[said["name"]], "predicates": predicates}

    def _unit(self, said: Table) -> Table:
        return said | {
            "name": self.words[said["name"]],
            "type": self.type(said["type"]),
            "outputs": [self._slot(slot) for slot in said["outputs"]],
            "inputs": [self._slot(slot) for slot in said["inputs"]],
        }

    def _slot(self, said: Table) -> Table:
        return said | {"name": self.words[said["name"]], "type": self.type(said["type"])}

    def _slot_type(self, name: str) -> str:
        return name if self.core.has(Part.TYPE, name) else self.words[name]


def chosen(packages: Sequence[Package], descriptions: Iterable[Table], words: Words) -> Names:
    """Choose a new name for everything that the packages name and the core does not."""
    core = Core()
    said = list(descriptions)
    payloads = [package.payload for package in packages if package.payload]
    parts = {(part, t.text) for d in said for part, t in spoken(d) if not core.has(part, t.text)}
    own = {name for part, name in parts if part not in (Part.DOMAIN, Part.ACTION)}
    own.update(name for description in said for name in declared(description))
    own.update(name for payload in payloads for name in _manifest_names(payload))
    components = {c["id"]: words.name() for p in payloads for c in p["component"]}
    points = sorted({name for package in packages for name in package.entry_points})
    return Names(
        core=core,
        distributions={package.distribution: words.name() for package in packages},
        packages={name: f"{words.word()}_{words.word()}" for p in packages for name in p.packages},
        payloads={p["id"]: f"{words.word()}.{words.word()}.{words.name()}" for p in payloads},
        components=components,
        # Where a distribution has several, the one of a component is called like it.
        entry_points={name: components.get(name) or words.name() for name in points},
        files={name: f"{words.word()}.pddl" for name in sorted(set(_fragment_files(packages)))},
        domains={name: words.name() for name in _sorted(parts, Part.DOMAIN)},
        actions={name: words.name() for name in _sorted(parts, Part.ACTION)},
        words={name: words.name() for name in sorted(own)},
    )


def _sorted(parts: Iterable[tuple[Part, str]], wanted: Part) -> list[str]:
    return sorted(name for part, name in parts if part is wanted)


def _manifest_names(payload: Mapping[str, Any]) -> Iterator[str]:
    for component in payload["component"]:
        for kind in ("device", "unit"):
            yield from (entry["name"] for entry in component.get(kind, ()))


def _fragment_files(packages: Iterable[Package]) -> Iterator[str]:
    for package in packages:
        for top in package.packages:
            yield from (path.name for path in (package.folder / top).rglob("*.pddl"))
