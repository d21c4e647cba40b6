"""What a host calls components and plugins, where two payloads have some of one name. Pure.

What the first payload brings keeps its own name; the other's has the id of its payload behind it. A
name that was given does not change while its payload is here.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import field
from itertools import chain
from typing import TypeAlias

from nondum.sdk.description import Behaviour, Fragment, PluginDescription
from nondum.sdk.frozen import frozen

MARK = "--"
"""Before the payload's id. No manifest's id of a component, or distribution, has two hyphens."""
LONGEST = 63
"""As long as a component's id may be: folders, cgroups and the helper take no longer ones."""
_DIGITS = range(8, LONGEST - len(MARK))
"""Of the hash in a name that was cut: as many as are needed."""

Words: TypeAlias = tuple[tuple[Fragment, ...], tuple[Behaviour, ...]]
"""What a plugin means by its name: planning reads its actions from these."""


@frozen
class GivenNames:
    """What a host calls what one payload brings."""

    components: Mapping[str, str] = field(default_factory=dict)
    """Id in its manifest → name."""
    plugins: Mapping[str, str] = field(default_factory=dict)
    """Distribution → what its actions and types are called by."""


NO_NAMES = GivenNames()


def forms(own: str, payload_id: str) -> Iterator[str]:
    """The names that something of a payload may have on a host, the best first.

    >>> from itertools import islice
    >>> list(islice(forms("gps", "org.example.north"), 3))
    ['gps', 'gps--org-example-north', 'gps--org-example-north--58498aca']
    """
    yield own
    whole = f"{own}{MARK}{payload_id.replace('.', '-')}"
    if len(whole) <= LONGEST:
        yield whole
    digest = hashlib.sha256(f"{payload_id}/{own}".encode()).hexdigest()
    for digits in _DIGITS:
        yield f"{whole[: LONGEST - len(MARK) - digits]}{MARK}{digest[:digits]}"


def of_components(
    payload_id: str, ids: Iterable[str], kept: Mapping[str, str], taken: Collection[str]
) -> dict[str, str]:
    """Id → name of each component of a payload. What it was called before (`kept`) stays; nothing
    gets a name that another payload's component has (`taken`). What is called by its name here, as
    what is remembered of a payload, keeps that.

    >>> of_components("org.example.b", ["gps", "clock"], {}, {"gps"})
    {'gps': 'gps--org-example-b', 'clock': 'clock'}
    """
    names: dict[str, str] = {}
    for id in ids:
        busy = {*taken, *names.values(), *(name for own, name in kept.items() if own != id)}
        is_name = id in kept.values()
        names[id] = kept.get(id) or (id if is_name else _free(forms(id, payload_id), busy))
    return names


def _free(names: Iterable[str], busy: Collection[str]) -> str:
    return next(name for name in names if name not in busy)


def of_plugin(
    own: str,
    payload_id: str,
    words: Collection[Words],
    kept: str | None,
    others: Mapping[str, Collection[Words]],
    given: Collection[str] = (),
) -> str:
    """What the actions of a payload's plugin are called by, if it says `words`.

    `others` are the names of other payloads' plugins, and what they say. A name is shared only by
    plugins that say the same: then they are one distribution, and each one's units can do all of
    it. Names that were `given` to plugins of other payloads stay theirs while they are away.
    """
    every = chain(
        (kept,) if kept else (), (name for name in forms(own, payload_id) if name not in given)
    )
    return next(name for name in every if name not in others or len({*words, *others[name]}) == 1)


def plugins_of_other_payloads(names: Mapping[str, GivenNames], payload_id: str) -> frozenset[str]:
    """The names that were given to plugins of all payloads but one, other than their own."""
    return frozenset(
        name
        for id, given in names.items()
        if id != payload_id
        for own, name in given.plugins.items()
        if own != name
    )


def words_of(description: PluginDescription) -> Words:
    """What a plugin means by its name."""
    return description.fragments, description.behaviours
