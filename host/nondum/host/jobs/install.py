"""Installing a staged payload, in a child process: wheels into the store, venvs of links to it."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from nondum.host.jobs import look
from nondum.host.jobs.installed_component import InstalledComponent
from nondum.host.jobs.table import Arguments, Report
from nondum.host.trust import chain
from nondum.sdk.codec.values import to_plain
from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem
from nondum.wheelhouse.build import source
from nondum.wheelhouse.format.data import BroughtData
from nondum.wheelhouse.format.lock import LockedWheel
from nondum.wheelhouse.format.manifest import ComponentManifest
from nondum.wheelhouse.payload import memory
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.payload import StagedPayload
from nondum.wheelhouse.store import disk, quota, venvs
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import StoredWheel
from nondum.wheelhouse.store.unpacking import THREADS


def install(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Make a payload's venvs and tell what its workers are started from. Idempotent.

    Afterwards, whatever a starting daemon needs to make them again is safe on disk. Raises
    `InstallFailed` (DISK_FULL, STORE_DAMAGED, …) and `PayloadRefused`, also when it is not trusted
    any more, or when the memory that it needs is reserved for other payloads, which is not checked
    without `headroom`.
    """
    folder, root = Path(arguments["folder"]), Path(arguments["venvs"])
    by_pip = arguments["method"] == "pip"
    staged = look.load_staged(folder)
    grant = chain.grant_of_kept(arguments, folder, staged.manifest, staged.goals)
    facts = look.facts_of(arguments)
    _refuse_without_memory(arguments, staged, facts)
    root.mkdir(parents=True, exist_ok=True)
    _keep_data(arguments, staged)
    with ThreadPoolExecutor(1) as pool:  # disks take their time; what is linked is not waited for
        synced = pool.submit(_sync, folder, with_wheels=by_pip)
        if by_pip:
            _make_with_pip(arguments, staged, facts, report)
            fresh, uncompiled = 0, False
        else:
            fresh, uncompiled = make_venvs(arguments, staged, facts, report)
        synced.result()
    if not by_pip:
        shutil.rmtree(folder / "wheels", ignore_errors=True)  # the store has them now
    components = [_told(staged, component, root) for component in staged.manifest.components]
    return {
        "fresh": fresh,
        "uncompiled": uncompiled,
        "components": components,
        "needs": _needs(staged),
        "gpu": to_plain(facts.memory.gpu),
        "grant": grant.to_dict(),
        "goals": list(staged.goals),
        "data": [_told_data(staged, brought) for brought in staged.manifest.data],
    }


def _refuse_without_memory(arguments: Arguments, staged: StagedPayload, facts: HostFacts) -> None:
    if arguments["headroom"] is not None:
        have, said = look.memory_for(arguments, facts), staged.manifest
        look.refuse_if_any(tuple(memory.problems(said.requires, have, said.id)))


def _needs(staged: StagedPayload) -> dict[str, Any]:
    requires = staged.manifest.requires
    return {
        "payload_id": staged.manifest.id,
        "memory_mb": requires.memory_mb,
        "gpu_memory_mb": requires.gpu_memory_mb,
        "alone": requires.alone,
    }


def make_venvs(
    arguments: Arguments, staged: StagedPayload, facts: HostFacts, report: Report
) -> tuple[int, bool]:
    """Make the venvs from the store; how many wheels it did not have, and whether any was there
    that is not compiled yet."""
    wheels = look.chosen(staged, facts)
    stored, fresh = _stored(arguments, staged.folder, wheels, report)
    for component, chosen in staged.wheels(facts).items():
        linked = [stored[locked.sha256] for locked in chosen]
        venvs.make(Path(arguments["venvs"]) / component, Path(arguments["python"]), linked)
    return fresh, any(wheel.compiled_here is None for wheel in stored.values())


def _make_with_pip(
    arguments: Arguments, staged: StagedPayload, facts: HostFacts, report: Report
) -> None:
    selected = staged.wheels(facts)
    for number, (component, chosen) in enumerate(selected.items()):
        venv, python = Path(arguments["venvs"]) / component, Path(arguments["python"])
        # pip tells nothing of its progress: that it is at work is all that there is to report.
        alive = partial(report, "pip", number, len(selected))
        venvs.make_with_pip(venv, python, staged.folder, chosen, alive)


def _keep_data(arguments: Arguments, staged: StagedPayload) -> None:
    """Have the store know the payload's data, and their folders on disk."""
    store, folders = look.data_store(arguments), set[Path]()
    for entry in staged.data_files:
        path = staged.folder / entry.path
        store.keep(path, entry.sha256)
        inside = len(path.relative_to(staged.folder).parts) - 1
        folders.update(path.parents[:inside])
    for folder in folders:
        disk.sync(folder)


def _sync(folder: Path, *, with_wheels: bool) -> None:
    """Have a payload's folder on disk: its metadata, and wheels where the store has them not."""
    wheels = folder / "wheels"
    if with_wheels and wheels.exists():
        disk.sync_files(wheels)
    disk.sync_files(folder)
    disk.sync(folder.parent)


def in_use(arguments: Arguments, report: Report) -> dict[str, set[str]]:
    """Payload key → hashes of the wheels and data that it needs, of the payload folders given."""
    facts = look.facts_of(arguments)
    staged = [look.load_staged(Path(f)) for f in arguments["folders"] if Path(f).exists()]
    return {
        one.folder.name: {w.sha256 for w in _wheels_for(one, facts) or ()}
        | {d.sha256 for d in one.data_files}
        for one in staged
    }


def without_wheels(arguments: Arguments, report: Report) -> list[str]:
    """Keys of those of the payload folders given whose wheels for this host are not all here: they
    were copied for another Python."""
    facts = look.facts_of(arguments)
    folders = map(Path, arguments["folders"])
    return [folder.name for folder in folders if _lacks(arguments, folder, facts)]


def _lacks(arguments: Arguments, folder: Path, facts: HostFacts) -> bool:
    try:
        staged = look.load_staged(folder)
        wheels = look.chosen(staged, facts)
    except (PayloadRefused, OSError):
        return True
    known = look.known_wheels(arguments, staged, facts)
    return any(w.sha256 not in known and not (staged.folder / w.path).exists() for w in wheels)


def _wheels_for(staged: StagedPayload, facts: HostFacts) -> tuple[LockedWheel, ...] | None:
    """The wheels that this host needs; None: there are none for it."""
    try:
        return look.chosen(staged, facts)
    except PayloadRefused:
        return None


def prune(arguments: Arguments, report: Report) -> list[str]:
    """Delete wheels and data that no payload needs, least recently used first, down to the quota:
    the hashes of what is gone."""
    used = {sha256 for group in in_use(arguments, report).values() for sha256 in group}
    stores = Store(Path(arguments["store"])), look.data_store(arguments)
    return list(quota.prune(stores, used, arguments["quota_mb"] * 1024 * 1024))


def listing(arguments: Arguments, report: Report) -> list[dict[str, Any]]:
    """What the stores of wheels and data hold, and which payloads need it; data have no name."""
    used = in_use(arguments, report)
    wheels = Store(Path(arguments["store"])).listing()
    found = [(stored.filename, stored.size, stored.sha256) for stored in wheels]
    found += [("", data.size, data.sha256) for data in look.data_store(arguments).kept()]
    return [
        {
            "wheel": filename,
            "bytes": size,
            "used_by": sorted(key for key, group in used.items() if sha256 in group),
            "sha256": sha256,
        }
        for filename, size, sha256 in found
    ]


def sweep(arguments: Arguments, report: Report) -> list[str]:
    """Delete what an interrupted run left half done in the store."""
    return [path.name for path in Store(Path(arguments["store"])).sweep()]


def _stored(
    arguments: Arguments, folder: Path, wheels: Sequence[LockedWheel], report: Report
) -> tuple[dict[str, StoredWheel], int]:
    """The wheels in the store, and how many were not there before."""
    store = Store(Path(arguments["store"]))
    fresh = sum(store.get(locked.sha256) is None for locked in wheels)
    paths = [(folder / locked.path, locked.sha256) for locked in wheels]
    copied = [(path, sha256) for path, sha256 in paths if path.exists()]
    alive = partial(report, "check", 0, 1)  # how much there is to be read is not counted
    added = store.add_all(copied, partial(report, "install"), alive)
    stored = {wheel.sha256: wheel for wheel in added}
    known = [locked for locked in wheels if locked.sha256 not in stored]
    with ThreadPoolExecutor(THREADS) as pool:
        checked = pool.map(lambda locked: _checked(store, locked, alive), known)
        stored.update((wheel.sha256, wheel) for wheel in checked)
    return stored, fresh


def _checked(store: Store, locked: LockedWheel, alive: Callable[[], None]) -> StoredWheel:
    """A wheel that was not copied because the store had it."""
    found = store.whole(locked.sha256, alive)
    if found is not None:
        return found
    store.remove(locked.sha256)  # so that it is copied the next time
    raise InstallFailed(
        Problem(
            "STORE_DAMAGED",
            f"{locked.filename} in the store is not what was stored",
            where=str(store.root),
            fix="pull the payload and plug it in again",
        )
    )


def _told_data(staged: StagedPayload, brought: BroughtData) -> dict[str, Any]:
    sizes = {entry.path: entry.size for entry in staged.data_files}
    return {
        "name": brought.name,
        "kind": brought.kind,
        "version": brought.version,
        "files": list(brought.files),
        "size": sum(sizes[path] for path in brought.paths),
    }


def _told(staged: StagedPayload, component: ComponentManifest, root: Path) -> Any:
    venv = root / component.id
    site_packages = venvs.site_packages(venv)
    entry_point = source.installed_entry_point(component.distribution, component.id, site_packages)
    return to_plain(
        InstalledComponent(
            component.id,
            component.distribution,
            entry_point,
            staged.index[component.id],
            venv,
            site_packages,
            component.permissions,
            component.settings,
            component.devices,
            component.units,
            component.limits,
            component.data,
        )
    )
