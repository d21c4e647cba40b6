"""The drives of a demonstration, made from the plugins of this checkout."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from demo.drives import HERE, Target, build, payload_id
from demo.maker import Maker

ROOT = Path(__file__).parent.parent
PLUGINS = ROOT / "plugins"
CACHE = ROOT / ".run/drives"
MAKER = ROOT / ".run/maker"


@dataclass(frozen=True, slots=True)
class Kit:
    """The drives of a demonstration, by the names of the plugin folders they were built from."""

    drives: Mapping[str, Path]
    payloads: Mapping[str, str]
    """Payload ids."""
    trust: Path
    """The trust file by which robots let them in."""

    @classmethod
    def built(
        cls,
        names: Sequence[str],
        *,
        libraries: Sequence[str],
        folders: Mapping[str, Path],
        cache: Path = CACHE,
        target: Target = HERE,
    ) -> Kit:
        """Build drives, or take them from the cache. `folders` are the sources of plugins and
        libraries that are not where they are in the checkout."""
        where = {name: folders.get(name, PLUGINS / name) for name in (*names, *libraries)}
        maker = Maker.at(MAKER)
        drives = build(
            [where[name] for name in names],
            libraries=[where[name] for name in libraries],
            cache=cache,
            maker=maker,
            target=target,
        )
        by_name = {name: drives[where[name].name] for name in names}
        payloads = {name: payload_id(drive) for name, drive in by_name.items()}
        return cls(by_name, payloads, maker.trust)

    def of(self, names: Sequence[str]) -> dict[str, Path]:
        """Payload id → drive, in the order of `names`."""
        return {self.payloads[name]: self.drives[name] for name in names}


def set_up(name: str, sources: Path, settings: str) -> Path:
    """A copy of a plugin's folder with other settings, lines of TOML, in its manifest."""
    folder = Path(shutil.copytree(PLUGINS / name, sources / name))
    with (folder / "payload.toml").open("a", encoding="utf-8") as manifest:
        manifest.write(f"\n[component.settings]\n{settings}")
    return folder
