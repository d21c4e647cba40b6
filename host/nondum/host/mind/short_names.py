"""Names of units and streams as people read them: `camera`, not `rover__eye__camera`.

A name is as short as it can be without meaning two things. Plans are told by what is done, not with
what: `eye.stream`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping

from nondum.host.core.names import shortened
from nondum.planning.merge.contribution import id_at_home
from nondum.planning.merge.domain import Object


def short_names(objects: Mapping[str, Object]) -> dict[str, str]:
    """Whole name → short one, of those units and streams that have one.

    >>> def unit(component: str, local: str) -> Object:
    ...     return Object(f"rover__{component}__{local}", ("unit",), local, "rover", component)
    >>> units = [unit("eye", "camera"), unit("eye", "image"), unit("lens", "image")]
    >>> sorted(short_names({unit.name: unit for unit in units}).values())
    ['camera', 'eye.image', 'lens.image']
    """
    owned = [found for found in objects.values() if found.component]
    # What is no unit has its own name already, and keeps it.
    free = {name for name, found in objects.items() if not found.component}
    found: dict[str, str] = {}
    for form in (_local, _of_component):
        left = [one for one in owned if one.name not in found]
        times = Counter(form(one) for one in left)
        found |= {one.name: form(one) for one in left if times[form(one)] == 1}
        found = {whole: short for whole, short in found.items() if short not in free}
    return found


def steps(actions: Iterable[str], names: Mapping[str, str]) -> dict[str, str]:
    """Action of a plan → what it is called: the behaviour, and with what only where one plan has
    several of it.

    >>> steps(["eye.look rover__eye__camera rover", "base.go hall", "base.go den"], {}).values()
    dict_values(['eye.look', 'base.go hall', 'base.go den'])
    """
    actions = list(dict.fromkeys(actions))
    times = Counter(action.split(" ")[0] for action in actions)
    return {
        action: schema if times[schema := action.split(" ")[0]] == 1 else shortened(action, names)
        for action in actions
    }


def told(text: str, called: Mapping[str, str], names: Mapping[str, str]) -> str:
    """A text about steps of a plan, with what they are called, and short names."""
    for action in sorted(called, key=len, reverse=True):
        text = text.replace(action, called[action])
    return shortened(text, names)


def _local(unit: Object) -> str:
    return unit.local


def _of_component(unit: Object) -> str:
    return f"{id_at_home(unit.component)}.{unit.local}"
