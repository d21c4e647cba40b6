"""Whether all in an environment have what they ask for, as `pip check` tells."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from nondum_dev.lockfile import canonical

_MISSING = re.compile(r"\S+ \S+ requires (?P<name>\S+), which is not installed\.")


@dataclass(frozen=True, slots=True)
class Checked:
    """What `pip check` has answered."""

    status: int
    output: str

    def flaws(self, own: Collection[str]) -> tuple[str, ...]:
        """What does not fit. Distributions of the checkout, `own`, may be missing: tox installs
        them one after the other.

        >>> Checked(1, "a 1.0 has requirement b<2, but you have b 2.1.\\n").flaws(own=())
        ('a 1.0 has requirement b<2, but you have b 2.1.',)
        >>> Checked(1, "a 1.0 requires nondum, which is not installed.\\n").flaws({"nondum"})
        ()
        """
        if self.status == 0:
            return ()
        lines = tuple(filter(None, map(str.strip, self.output.splitlines())))
        if not lines:
            return (f"`pip check` ended with {self.status} and said nothing",)
        return tuple(line for line in lines if not _is_to_come(line, own))


def _is_to_come(line: str, own: Collection[str]) -> bool:
    found = _MISSING.fullmatch(line)
    return found is not None and canonical(found["name"]) in own
