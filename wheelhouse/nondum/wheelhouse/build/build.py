"""Building a payload folder from a plugin's source folder: what `nondum payload build` does."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
import time
import zipfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from packaging.utils import parse_wheel_filename

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import InstallFailed, Problem, problems_of
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.build import capture, locking, resolve, source
from nondum.wheelhouse.build.library_wheels import library_wheel
from nondum.wheelhouse.build.resolve import Sources
from nondum.wheelhouse.format import contents, goals, index, lock, manifest
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.format.manifest import Manifest
from nondum.wheelhouse.format.target import Target
from nondum.wheelhouse.store import disk
from nondum.wheelhouse.wheels import wheel

MINIMUM_NONDUM = "0.1"
"""The oldest nondum that reads what is written here."""
_PIECE = 4 * 1024 * 1024
_FINE = 100
"""Parts of a step, as progress counts them."""
PROCESSES = 4
"""pips at once: they wait for the index most of the time."""

Progress = Callable[[str, int, int], None]
_T = TypeVar("_T")


@frozen
class Options:
    """How a payload is built."""

    targets: tuple[Target, ...]
    sources: Sources = field(default_factory=Sources)
    libraries: tuple[Path, ...] = ()
    """Source folders of distributions that it depends on and that no index has."""
    release: int | None = None
    """None: the time of building, in seconds."""
    fleet: str = ""
    hosts: tuple[str, ...] = ()
    """Names of the only hosts that it is meant for; empty: any."""
    judge: source.Judge = lambda _: ()
    finish: Callable[[Path], object] = lambda _: None
    """Done to the payload's folder when all but this is in it, before a drive has it: signing."""


def build(package: Path, drive: Path, options: Options, progress: Progress) -> Path:
    """Build one payload folder on a drive and return it; replaces one of the same id.

    `progress` gets what is being done, and how far all of it is. Raises `PayloadRefused`,
    `InstallFailed`; nothing is left on the drive then.
    """
    said = source.manifest_of(package)
    with tempfile.TemporaryDirectory(prefix="nondum-build-") as temporary:
        work = Path(temporary)
        steps = _Steps(progress, 4 + len(options.targets))
        steps.at("making the wheels of the sources", 0)
        own, *libraries = _made(package, work / "made", options)
        folders = (*(path.parent for path in libraries), *options.sources.wheel_folders)
        sources = replace(options.sources, wheel_folders=folders)
        chosen = _fetched(own, work, options, sources, steps)
        steps.at("asking the plugin what it is", -3)
        described = _described(said, chosen[Target.here()], work / "site-packages")
        wheel.refuse_if_any(source.description_problems(said, described, options.judge))
        steps.at("writing the payload", -2)
        locked = {target: chosen[target] for target in options.targets}
        folder = work / said.id
        _write(folder, package, said, locked, described)
        _judge(folder / "wheels", said)
        fleet, hosts = options.fleet, options.hosts
        seal(folder, said.id, _version(own), options.release, fleet=fleet, hosts=hosts)
        options.finish(folder)
        target = deliver(folder, drive, steps.within_the_last)
        steps.at("done", steps.count)
        return target


class _Steps:
    """Tells of steps, the last of which is long."""

    def __init__(self, progress: Progress, count: int) -> None:
        self._progress, self.count = progress, count

    def at(self, what: str, number: int) -> None:
        """A number of steps is done; below 0: that number is left."""
        done = number if number >= 0 else self.count + number
        self._progress(what, done * _FINE, self.count * _FINE)

    def within_the_last(self, what: str, done: int, total: int) -> None:
        """All are done but the last, and a part of that."""
        part = _FINE * done // max(total, 1)
        self._progress(what, (self.count - 1) * _FINE + part, self.count * _FINE)


def _made(package: Path, work: Path, options: Options) -> list[Path]:
    """The wheels of the package and of its libraries, each in a separate folder."""
    libraries = [
        partial(library_wheel, library, work / str(number), options.sources)
        for number, library in enumerate(options.libraries)
    ]
    return _all_of(
        [partial(resolve.make_wheel, package, work / "own", options.sources), *libraries]
    )


def _all_of(tasks: Sequence[Callable[[], _T]]) -> list[_T]:
    """Do all side by side. Raises `InstallFailed` with the problems of all."""
    with ThreadPoolExecutor(PROCESSES) as pool:
        futures = [pool.submit(task) for task in tasks]
    errors = [error for future in futures if (error := future.exception()) is not None]
    failures = [error for error in errors if isinstance(error, InstallFailed)]
    if errors and len(failures) == len(errors):
        raise InstallFailed(*dict.fromkeys(problems_of(failures)))
    return [future.result() for future in futures]


def _fetched(
    own: Path, work: Path, options: Options, sources: Sources, steps: _Steps
) -> dict[Target, tuple[Path, ...]]:
    """The wheels for every target, and for this machine, which must describe the plugin."""
    targets = list(dict.fromkeys((*options.targets, Target.here())))
    steps.at("fetching the wheels that it depends on", 1)
    fetched = _all_of(
        [
            partial(resolve.fetch, own, target, work / f"fetched-{number}", sources)
            for number, target in enumerate(targets)
        ]
    )
    return dict(zip(targets, fetched, strict=True))


def _described(
    said: Manifest, wheels: Sequence[Path], site_packages: Path
) -> dict[str, PluginDescription]:
    for path in wheels:
        _unpack(path, site_packages)
    described = {}
    for component in said.components:
        found = source.installed_entry_point(component.distribution, component.id, site_packages)
        described[component.id] = capture.describe(site_packages, found, component.distribution)
    return described


def _unpack(path: Path, site_packages: Path) -> None:
    with wheel.opened(path) as data:
        layout = wheel.lay_out(data, path.name)
        wheel.refuse_if_any(layout.problems)
        names = {file.member.path: file.target for file in layout.files}
    with zipfile.ZipFile(path) as archive:
        for name, target in names.items():
            place = site_packages / target
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(archive.read(name))


def _write(
    folder: Path,
    package: Path,
    said: Manifest,
    locked: Mapping[Target, Sequence[Path]],
    described: Mapping[str, PluginDescription],
) -> None:
    wheels = folder / "wheels"
    wheels.mkdir(parents=True)
    for path in (path for group in locked.values() for path in group):
        if not (wheels / path.name).exists():
            os.link(path, wheels / path.name)
    shutil.copyfile(package / manifest.NAME, folder / manifest.NAME)
    link_data(folder, source.data_of(package, said))
    if wanted := source.goals_of(package):
        (folder / goals.NAME).write_bytes(goals.to_bytes(wanted))
    for component in said.components:
        text = locking.lock_text(locked)
        (folder / lock.file_name(component.id)).write_text(text, encoding="utf-8")
    (folder / index.NAME).write_bytes(index.to_bytes(described))


def link_data(folder: Path, files: Mapping[str, Path]) -> None:
    """Put data in a payload's folder that is still to be sealed and delivered: by links, since they
    may be larger than the file system that it is on."""
    for path, at in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).symlink_to(at.resolve())


def _version(own: Path) -> str:
    return str(parse_wheel_filename(own.name)[1])


def _judge(wheels: Path, said: Manifest) -> None:
    """Refuse wheels that every host would refuse."""
    problems: list[Problem] = []
    for path in sorted(wheels.glob("*.whl")):
        with wheel.opened(path) as data:
            layout = wheel.lay_out(data, path.name)
        problems += layout.problems
        problems += wheel.hook_problems(layout.left_out, path.name, said.startup_hooks)
    wheel.refuse_if_any(tuple(problems))


def seal(
    folder: Path,
    payload_id: str,
    version: str,
    release: int | None = None,
    *,
    fleet: str = "",
    hosts: tuple[str, ...] = (),
) -> None:
    """Write the contents list of what the folder holds; without a release, it is the time.

    Raises `PayloadRefused` (CONTENTS_HEADER): a name that is none.
    """
    now = int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))
    paths = sorted(
        (path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()),
    )
    listed = Contents(
        payload_id=payload_id,
        version=version,
        release=now if release is None else release,
        fleet=fleet,
        minimum_nondum=MINIMUM_NONDUM,
        built=time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(now)),
        entries=tuple(
            Entry(locking.sha256(folder / p), (folder / p).stat().st_size, p) for p in paths
        ),
        hosts=hosts,
    )
    contents.parse(listed.to_bytes(), contents.NAME)  # refuses fleets and hosts that are no names
    (folder / contents.NAME).write_bytes(listed.to_bytes())


def deliver(folder: Path, drive: Path, progress: Progress = lambda what, done, total: None) -> Path:
    """Put the folder on the drive: copied beside, then put in the place of the one that is there,
    at one stroke where the file system can, so that a host that has it plugged in sees one or the
    other. What links lead to is copied. Once it returns, the drive may be pulled.

    Raises `InstallFailed` (DISK_FULL, IO_ERROR).
    """
    target = drive / "nondum" / folder.name
    beside = target.with_name(f".{folder.name}.part")
    shutil.rmtree(beside, ignore_errors=True)
    total = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    done = 0

    def copied(size: int) -> None:
        nonlocal done
        done += size
        progress("copying it to the drive", done, total)

    try:
        shutil.copytree(folder, beside, copy_function=partial(_copy, copied))
    except InstallFailed:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    if not (target.exists() and disk.exchange(beside, target)):
        shutil.rmtree(target, ignore_errors=True)
        beside.rename(target)
    shutil.rmtree(beside, ignore_errors=True)
    disk.sync_file_system(target.parent)
    return target


def _copy(copied: Callable[[int], None], source: str, target: str) -> str:
    """Copy one file for `shutil.copytree`, which takes what is returned for its new path."""
    try:
        with open(source, "rb") as read, open(target, "wb") as written:  # noqa: PTH123  # texts
            while piece := read.read(_PIECE):
                written.write(piece)
                copied(len(piece))
    except OSError as error:
        raise _undelivered(error, target) from error
    return target


def _undelivered(error: OSError, target: str) -> InstallFailed:
    code = "DISK_FULL" if error.errno in (errno.ENOSPC, errno.EDQUOT) else "IO_ERROR"
    fix = "see whether the drive is there, and may be written to"
    if code == "DISK_FULL":
        fix = "take a larger drive, or delete something from it"
    elif error.errno == errno.EFBIG:  # FAT takes no file of 4 GiB
        fix = "format the drive with a file system for large files, as exFAT or ext4"
    text = f"cannot be copied to the drive: {error.strerror}"
    return InstallFailed(Problem(code, text, where=target, fix=fix))
