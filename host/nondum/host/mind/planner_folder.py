"""Where a planner writes down what it searches. It may be killed at any moment, and leave that."""

from __future__ import annotations

import logging
import shutil
import tempfile
from pathlib import Path

log = logging.getLogger(__name__)


class PlannerFolder:
    """The temporary files of one planner's process."""

    def __init__(self, name: str, parent: Path | None) -> None:
        """None: where this machine has temporary files."""
        self._name = name
        self._parent = parent
        self._path: Path | None = None

    def make(self) -> str:
        """Make it empty, and return where it is.

        It is nowhere if it cannot be made: most planners need no files, and a disk may be full.
        """
        self.remove()
        try:
            if self._parent is None:
                self._path = Path(tempfile.mkdtemp(prefix=f"nondum-{self._name}-"))
            else:
                self._path = self._parent / self._name
                _remove(self._path)  # of the daemon before
                self._path.mkdir(mode=0o700, parents=True)
        except OSError as error:
            log.warning("planner %s has no folder for its files: %s", self._name, error)
            return ""
        return str(self._path)

    def remove(self) -> None:
        """Remove it with all that is in it."""
        path, self._path = self._path, None
        if path is not None:
            _remove(path)


def _remove(path: Path) -> None:
    shutil.rmtree(path, ignore_errors=True)
