"""Run by itself: print what a plugin says about itself, as JSON.

    python describe.py MODULE[:ATTRIBUTE] DISTRIBUTION

What a plugin says does not depend on the libraries that it works with, so those that are not
installed here are stood in for.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from unittest.mock import MagicMock

from nondum.sdk.plugin import describe, load


class Absent(MetaPathFinder, Loader):
    """Finds each module that no other finder has found: a mock that has every attribute."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """A stand-in for a library, never for a part of one that is there."""
        top = fullname.partition(".")[0]
        is_theirs = top in sys.modules and not isinstance(sys.modules[top], MagicMock)
        return None if is_theirs else ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Anything may be asked of it."""
        return MagicMock(name=spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """There is nothing to run."""


if __name__ == "__main__":
    sys.meta_path.append(Absent())
    json.dump(describe(load(sys.argv[1], sys.argv[2])).to_dict(), sys.stdout)
