"""Everything wrong with a payload folder, by the functions that hosts judge drives with.

A host stops at the first step that fails, since it goes on with nothing that it may not believe.
Here the caller wants all problems, so every step that is still possible is done.
"""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path

from nondum.sdk.errors import NondumError, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format import contents, manifest
from nondum.wheelhouse.format.contents import Contents
from nondum.wheelhouse.format.signatures import Verdict, Verifier
from nondum.wheelhouse.payload import drive, payload
from nondum.wheelhouse.payload.drive import Progress
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.payload import StagedPayload
from nondum.wheelhouse.payload.preflight import preflight
from nondum.wheelhouse.wheels import wheel


@frozen
class Verified:
    """What was found out about a payload folder."""

    problems: tuple[Problem, ...]
    """Why a host would refuse it; empty: it would not."""
    warnings: tuple[Problem, ...] = ()
    """What is doubtful, and does not keep it out."""
    signers: tuple[str, ...] = ()
    """Whose signatures hold: names in the trust file, else fingerprints."""
    payload: StagedPayload | None = None
    """What it says of itself, where that could be read; its files are gone."""


def verify(
    folder: Path,
    verifier: Verifier,
    facts: HostFacts | None = None,
    progress: Progress | None = None,
) -> Verified:
    """Judge a payload folder; with `facts`, also whether it fits that host.

    Raises `OSError` of this host's own disk.
    """
    try:
        return _verified(folder, verifier, facts, progress)
    except (OSError, MemoryError):
        raise
    except Exception as error:
        return Verified((unforeseen(error, folder),))


def unforeseen(error: Exception, folder: Path) -> Problem:
    """What is told of a payload whose reading failed in a way that no refusal is made for."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    told = f"{type(error).__name__}: {str(error)[:200]} ({Path(last.filename).name}:{last.lineno})"
    fix = "report it with what it says, and build the payload again"
    return Problem("INTERNAL", told, where=folder.name, fix=fix)


def _verified(
    folder: Path, verifier: Verifier, facts: HostFacts | None, progress: Progress | None
) -> Verified:
    try:
        data = drive.read_contents(folder)
        verdict = verifier.verify(data, drive.read_signature(folder))
    except NondumError as error:
        return Verified(error.problems)
    problems = list(verdict.problems)
    staged = None
    try:
        listed = contents.parse(data, f"{folder.name}/{contents.NAME}")
        problems.extend(found := tuple(payload.oversized(listed)))
        if not found:
            with tempfile.TemporaryDirectory(prefix="nondum-verify-") as staging:
                copied = Path(staging) / "payload"
                drive.copy(
                    folder, listed, copied, progress, lambda entry: not payload.is_data(entry.path)
                )
                drive.check(folder, listed, progress, lambda entry: payload.is_data(entry.path))
                staged = _loaded(copied, listed, problems)
                problems.extend(_found(copied, staged, verdict, facts))
    except NondumError as error:
        problems.extend(error.problems)
    # Some things are asked twice, as on hosts: of each file, and of what would be installed.
    unique = tuple(dict.fromkeys(problems))
    return Verified(unique, verdict.warnings, verdict.signers, staged)


def _loaded(copied: Path, listed: Contents, problems: list[Problem]) -> StagedPayload | None:
    try:
        return payload.load(copied, listed)
    except NondumError as error:
        problems.extend(error.problems)
        return None


def _found(
    copied: Path, staged: StagedPayload | None, verdict: Verdict, facts: HostFacts | None
) -> Iterator[Problem]:
    """What is wrong with the parts of a staged copy."""
    for path in sorted((copied / "wheels").glob("*.whl")):
        hooks = staged.manifest.startup_hooks if staged is not None else _hooks_of(copied)
        yield from wheel.check(path, hooks)
    if staged is None:
        return
    if not verdict.problems:
        yield from verdict.grant.problems(staged.manifest, staged.goals)
    yield from payload.device_problems(staged)
    if facts is None:
        return
    minimum = staged.contents.minimum_nondum
    yield from preflight(staged.manifest, staged.locks, facts, minimum_nondum=minimum)
    try:
        yield from payload.check_wheels(staged, facts)
    except NondumError as error:
        yield from error.problems


def _hooks_of(copied: Path) -> tuple[str, ...]:
    """The hooks that the manifest names, if that at least can be read."""
    try:
        text = (copied / manifest.NAME).read_text(encoding="utf-8")
        return manifest.parse(text, manifest.NAME, brings_goals=True).startup_hooks
    except (NondumError, OSError, UnicodeDecodeError):
        return ()
