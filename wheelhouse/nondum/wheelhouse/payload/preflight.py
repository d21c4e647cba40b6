"""Whether a payload fits this host, from what was parsed, before anything is installed.

Every problem is told at once, with what is needed and what is there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from packaging.markers import UndefinedComparison, UndefinedEnvironmentName
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import Version

from nondum.sdk.errors import NondumError, PayloadRefused, Problem
from nondum.wheelhouse.format import lock as locks_module
from nondum.wheelhouse.format.limits import not_granted
from nondum.wheelhouse.format.lock import Lock, LockedWheel
from nondum.wheelhouse.format.manifest import Manifest
from nondum.wheelhouse.payload import memory
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.wheels import wheel
from nondum.wheelhouse.wheels.wheel import Layout

_MB = 1024 * 1024


def select(
    manifest: Manifest, locks: Mapping[str, Lock], facts: HostFacts
) -> dict[str, tuple[LockedWheel, ...]]:
    """The wheels of each component for this host. Raises `PayloadRefused` with all problems."""
    chosen: dict[str, tuple[LockedWheel, ...]] = {}
    problems: list[Problem] = []
    for component in manifest.components:
        if component.id not in locks:
            continue
        try:
            chosen[component.id] = locks_module.select(
                locks[component.id], facts.environment, facts.tags
            )
        except NondumError as error:
            problems.extend(error.problems)
    if problems:
        raise PayloadRefused(*problems)
    return chosen


def preflight(
    manifest: Manifest,
    locks: Mapping[str, Lock],
    facts: HostFacts,
    *,
    minimum_nondum: str = "0",
    stored: Collection[str] = (),
    data_bytes: int = 0,
) -> tuple[Problem, ...]:
    """Everything that keeps this payload from running here.

    `minimum_nondum` is what the contents list asks for; `stored` are the hashes of wheels that this
    host has already, which take no more of its disk, and `data_bytes` what it lacks of the data.
    """
    problems = [
        *_version_problems(manifest, facts, minimum_nondum),
        *memory.problems(manifest.requires, facts.memory, manifest.id),
        *_limit_problems(manifest, facts),
    ]
    for component in manifest.components:
        if component.id not in locks:
            where = locks_module.file_name(component.id)
            text = f"component {component.id!r} has no lock"
            problems.append(Problem("LOCK_MISSING", text, where=where))
    try:
        chosen = select(manifest, locks, facts)
    except PayloadRefused as error:
        return (*problems, *error.problems)
    problems.extend(_unlocked(manifest, locks, chosen))
    return (*problems, *_disk_problems(manifest, chosen, facts, stored, data_bytes))


def _unlocked(
    manifest: Manifest, locks: Mapping[str, Lock], chosen: Mapping[str, Sequence[LockedWheel]]
) -> Iterator[Problem]:
    """Components whose own plugin is not among their wheels."""
    for component in manifest.components:
        if component.id not in locks:
            continue
        if component.distribution not in {wheel.name for wheel in chosen[component.id]}:
            is_for_others = component.distribution in locks[component.id].packages
            text = "is locked for other hosts only" if is_for_others else "itself is not locked"
            yield Problem(
                "LOCK_INCOMPLETE",
                f"{component.distribution} {text}",
                where=locks_module.file_name(component.id),
                fix="build the payload for this architecture and Python",
            )


def unmet(
    requirements: Mapping[str, Sequence[str]],
    chosen: Sequence[LockedWheel],
    facts: HostFacts,
    where: str,
) -> Iterator[Problem]:
    """Dependencies that no chosen wheel meets; `requirements` are distribution → Requires-Dist.

    Extras that one distribution asks of another are followed.
    """
    versions = {wheel.name: wheel.version for wheel in chosen}
    asked = {(distribution, "") for distribution in requirements}
    pending = sorted(asked)
    while pending:
        distribution, extra = pending.pop()
        for line in requirements.get(distribution, ()):
            try:
                wanted = _wanted(line, extra, facts)
            except (ValueError, RecursionError, UndefinedComparison, UndefinedEnvironmentName):
                text = f"{distribution} has a dependency that cannot be read: {line[:80]!r}"
                yield Problem("WHEEL_METADATA", text, where=where)
                continue
            if wanted is None:
                continue
            name = canonicalize_name(wanted.name)
            have = versions.get(name)
            if have is None or not wanted.specifier.contains(have, prereleases=True):
                yield _missing(distribution, wanted, have, where)
            more = {(str(name), wanted_extra) for wanted_extra in wanted.extras} - asked
            asked |= more
            pending += sorted(more)


def misfits(
    layout: Layout, filename: str, manifest: Manifest, facts: HostFacts
) -> Iterator[Problem]:
    """Why a sound wheel is not for this payload or host."""
    yield from wheel.hook_problems(layout.left_out, filename, manifest.startup_hooks)
    if layout.problems:  # what it needs is not known then
        return
    python = SpecifierSet(layout.needs.python)
    if not python.contains(facts.python, prereleases=True):
        yield Problem(
            "WHEEL_INCOMPATIBLE",
            "is not for this Python, whatever its name says",
            where=filename,
            need=f"Python {python}",
            have=facts.python,
            fix="build the payload for this architecture and Python",
        )


def unpacked_problems(layouts: Iterable[Layout], facts: HostFacts, where: str) -> Iterator[Problem]:
    """When wheels are too much for the disk, by the sizes of all their files."""
    needed = _whole_mb(sum(layout.size for layout in layouts))
    if needed > facts.free_disk_mb:
        yield _short(needed, facts, where)


def _wanted(line: str, extra: str, facts: HostFacts) -> Requirement | None:
    """A dependency as far as this host and extra have it."""
    wanted = Requirement(line)
    if wanted.marker is None:
        return wanted if not extra else None
    needs = wanted.marker.evaluate({**facts.environment, "extra": extra})
    always = extra and wanted.marker.evaluate({**facts.environment, "extra": ""})
    return wanted if needs and not always else None


def _missing(distribution: str, wanted: Requirement, have: str | None, where: str) -> Problem:
    return Problem(
        "LOCK_INCOMPLETE",
        f"{distribution} needs {wanted.name}",
        where=where,
        need=f"{wanted.name}{wanted.specifier}",
        have=have or "none",
        fix="build the payload again: every dependency must be locked",
    )


def _version_problems(
    manifest: Manifest, facts: HostFacts, minimum_nondum: str
) -> Iterator[Problem]:
    if Version(facts.nondum) < Version(minimum_nondum):
        yield Problem(
            "NONDUM_VERSION",
            "this nondum is too old",
            where=manifest.id,
            need=f">={minimum_nondum}",
            have=facts.nondum,
            fix="update the host, or use an older release of the payload",
        )
    wanted = SpecifierSet(manifest.requires.python)
    if not wanted.contains(facts.python, prereleases=True):
        yield Problem(
            "PYTHON_VERSION",
            "this Python does not fit",
            where=manifest.id,
            need=str(wanted),
            have=facts.python,
            fix="use a payload that was built for this Python",
        )
    if manifest.requires.confinement > facts.confinement:
        yield Problem(
            "CONFINEMENT",
            "workers cannot be confined as it demands",
            where=manifest.id,
            need=f"level {manifest.requires.confinement}",
            have=f"level {facts.confinement}",
            fix="see `nondum doctor` for what confinement lacks on this host, or use another host",
        )


def _limit_problems(manifest: Manifest, facts: HostFacts) -> Iterator[Problem]:
    fix = "use another host, or raise `most_{key}` under `[workers]` in its configuration"
    for component in manifest.components:
        yield from not_granted(component.id, component.limits, facts.most, "this host", fix)


def _disk_problems(
    manifest: Manifest,
    chosen: Mapping[str, Sequence[LockedWheel]],
    facts: HostFacts,
    stored: Collection[str],
    data_bytes: int,
) -> Iterator[Problem]:
    """What is copied stays until all of it is unpacked, so both are on the disk then."""
    wheels = {w.sha256: w for group in chosen.values() for w in group if w.sha256 not in stored}
    size = data_bytes + sum(wheel.size + wheel.unpacked for wheel in wheels.values())
    needed = max(manifest.requires.disk_mb, _whole_mb(size))
    if needed > facts.free_disk_mb:
        yield _short(needed, facts, manifest.id)


def _whole_mb(size: int) -> int:
    return -(-size // _MB)


def free_beside(free_mb: int, reserve_mb: int) -> str:
    """What there is of a disk, with what is kept of it.

    >>> free_beside(7, 64)
    '7 MB, beside the 64 MB that `install.reserve_mb` keeps free'
    """
    kept = f", beside the {reserve_mb} MB that `install.reserve_mb` keeps free"
    return f"{free_mb} MB{kept if reserve_mb else ''}"


def _short(needed_mb: int, facts: HostFacts, where: str) -> Problem:
    return Problem(
        "DISK_FULL",
        "there is too little disk",
        where=where,
        need=f"{needed_mb} MB",
        have=free_beside(facts.free_disk_mb, facts.reserve_mb),
        fix="free some disk, or use another host",
    )
