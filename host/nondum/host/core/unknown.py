"""What people are told of a name that nothing has: the nearest one, or all that there are."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from nondum.planning.merge.given_names import MARK
from nondum.sdk.errors import Problem


def unknown(kind: str, name: str, known: Iterable[str]) -> Problem:
    """What is told of a name that is none; of an id of manifests, all that have it are told.

    >>> unknown("component", "gps", ["lamp", "gps--org-a", "gps--org-b"]).fix
    "did you mean 'gps--org-a' or 'gps--org-b'?"
    """
    names = sorted(known)
    near = [one for one in names if one.startswith(f"{name}{MARK}")]
    near = near or difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    meant = " or ".join(map(repr, near))
    fix = f"did you mean {meant}?" if near else f"there is: {', '.join(names) or 'none'}"
    return Problem(f"{kind.upper()}_UNKNOWN", f"there is no {kind} {name!r}", fix=fix)
