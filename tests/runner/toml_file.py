"""Read a TOML file of the runner's: a mistake in it is told with its place, and ends the run."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any


def load(file: Path) -> dict[str, Any]:
    """The file's table. Raises SystemExit with the file and the line of a mistake."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SystemExit(f"{file}: {error}") from error
