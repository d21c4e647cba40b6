"""Wheels for a payload, made and fetched by pip.

pip runs as a separate process of this interpreter, with the index and caches that its user has
configured. What it chose is read from the wheels that it writes.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from nondum.sdk.errors import InstallFailed, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.target import Target

TIMEOUT_S = 1800

ADD_IT = "put its wheel into the folder that --wheels names"
_RAISED = re.compile(r"\w+(Error|Exception)\b: .")
_ABSENT = ("Could not find a version", "No matching distribution")
"""What pip begins with when a wheel is not there."""


@frozen
class Sources:
    """Where wheels come from."""

    wheel_folders: tuple[Path, ...] = ()
    """Folders of wheels, looked at before the index."""
    offline: bool = False
    """Only those folders, no index."""

    def options(self) -> list[str]:
        """The same for pip."""
        options = [part for folder in self.wheel_folders for part in ("--find-links", str(folder))]
        return [*options, "--no-index"] if self.offline else options


def make_wheel(package: Path, folder: Path, sources: Sources) -> Path:
    """Build a package's own wheel into `folder`, which is made. Raises `InstallFailed`
    (BUILD_FAILED)."""
    folder.mkdir(parents=True)
    absolute = package.absolute()  # pip takes `package` alone for a name in the index
    _pip(
        ["wheel", "--no-deps", "--wheel-dir", str(folder), *sources.options(), str(absolute)],
        "BUILD_FAILED",
        str(package),
        offline=sources.offline,
    )
    (made,) = folder.glob("*.whl")
    return made


def fetch(wheel: Path, target: Target, folder: Path, sources: Sources) -> tuple[Path, ...]:
    """A wheel and all that it depends on, for one target; by name.

    Raises `InstallFailed` (WHEEL_MISSING) that says what has no wheel.
    """
    folder.mkdir(parents=True)
    platforms = [part for p in target.platforms() for part in ("--platform", p)]
    _pip(
        [
            *("download", "--only-binary", ":all:", "--dest", str(folder)),
            *("--implementation", "cp", "--python-version", target.python),
            *platforms,
            *sources.options(),
            str(wheel),
        ],
        "WHEEL_MISSING",
        f"{wheel.name} for {target.architecture}, Python {target.python}",
        offline=sources.offline,
    )
    return tuple(sorted(folder.glob("*.whl")))


def _pip(arguments: Sequence[str], code: str, where: str, *, offline: bool) -> None:
    # `-I`: modules of the current folder are not run. Paths are relative to it all the same.
    pip = (sys.executable, "-I", "-m", "pip")
    command = [*pip, *arguments, "--quiet", "--disable-pip-version-check"]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        problem = Problem(code, f"pip took longer than {TIMEOUT_S} s", where=where)
        raise InstallFailed(problem) from error
    if done.returncode:
        line = error_line(done.stderr)
        fix = ADD_IT if offline and line.startswith(_ABSENT) else ""
        raise InstallFailed(Problem(code, line, where=where, fix=fix))


def error_line(said: str) -> str:
    """The line of pip's errors that says most: what a build raised, else its own first error.

    >>> error_line("ERROR: No matching distribution found for x\\n")
    'No matching distribution found for x'
    >>> error_line("  error: exit code 1\\n      OSError: Readme is missing\\nnote: not pip\\n")
    'OSError: Readme is missing'
    """
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    raised = [line for line in lines if _RAISED.match(line)]
    own = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    return next(iter([*raised[-1:], *own, *lines, "pip said nothing"]))
