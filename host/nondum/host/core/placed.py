"""Where in a component's plugin something is wrong, as the `where` of a problem."""

from __future__ import annotations


def placed(owner: str, place: str) -> str:
    """`where` of what is wrong with a component or a part of it, at a place in its plugin.

    >>> placed("gps", "gps/plugin.py:95"), placed("gps", "")
    ('gps (gps/plugin.py:95)', 'gps')
    """
    return f"{owner} ({place})" if place else owner


def place_of(where: str, owner: str) -> str | None:
    """The place that a `where` names; empty: none; None: it is of another owner.

    >>> place_of(placed("gps", "gps/plugin.py:95"), "gps"), place_of("gps", "gps")
    ('gps/plugin.py:95', '')
    >>> place_of(placed("gps", "gps/plugin.py:95"), "eye")
    """
    place = where.removeprefix(f"{owner} (").removesuffix(")")
    if where == placed(owner, place):
        return place
    return "" if where == owner else None
