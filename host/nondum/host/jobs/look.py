"""Reading a drive, in a child process: look for payloads, copy one to staging, check the copy.

Only the contents list is believed, and only the staged copy is parsed. What the store has already
is not copied again.
"""

from __future__ import annotations

import hashlib
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from packaging.version import Version

from nondum.host.core import payload_key
from nondum.host.core.brief import brief
from nondum.host.jobs import forked_trial
from nondum.host.jobs.loose_goals import loose_goals
from nondum.host.jobs.read_pace import paced
from nondum.host.jobs.table import Arguments, Report
from nondum.host.sandbox.helper import privileged
from nondum.host.trust.chain import packed
from nondum.host.trust.on_drives import trust_files_on
from nondum.host.trust.rules import Rules
from nondum.sdk.errors import NondumError, PayloadRefused, Problem
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.build import verification
from nondum.wheelhouse.format import confinement, contents
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.format.limits import WorkerLimits
from nondum.wheelhouse.format.lock import LockedWheel
from nondum.wheelhouse.format.signatures import Grant, Verdict, Verifier
from nondum.wheelhouse.payload import drive, host_facts, payload, preflight
from nondum.wheelhouse.payload.host_facts import HostFacts
from nondum.wheelhouse.payload.memory import Memory, Promised
from nondum.wheelhouse.payload.payload import StagedPayload
from nondum.wheelhouse.store.data_store import DataStore
from nondum.wheelhouse.store.store import Store
from nondum.wheelhouse.store.stored import StoredWheel
from nondum.wheelhouse.wheels.dist_info import Needs
from nondum.wheelhouse.wheels.wheel import Layout

CERTIFICATES = "nondum-peers"
"""Folder of a drive with hosts' certificates."""


def look(arguments: Arguments, report: Report) -> dict[str, list[Any]]:
    """Mount the drive if it is a device, and tell the `payloads`, host `certificates` and `trust`
    files on it, and what else is not as it should be, `flaws`. Payloads are judged as they will be
    once those are taken.

    Raises `DriveGone`, `PayloadRefused` (FS_UNSUPPORTED, FS_ERROR).
    """
    root = Path(arguments["root"])
    if arguments["node"] is not None:
        node, drive_name = Path(arguments["node"]), arguments["drive"]
        root = privileged().mount(node, root, arguments["filesystem"], drive_name, "read")
    is_payload = arguments["kind"] == "installed"
    folders = (root,) if is_payload else drive.find_payloads(root)
    offered, flaws = ((), ()) if is_payload else trust_files_on(root)
    rules = Rules.of(arguments).following(arguments.get("known_trust", ()), offered)
    verifier = rules.verifier()
    return {
        "trust": packed(offered),
        "trust_problems": [problem.to_dict() for problem in brief(flaws)],
        "flaws": [] if is_payload else [problem.to_dict() for problem in loose_goals(root)],
        "payloads": found(folders, verifier),
        "certificates": [] if is_payload else list(_certificates(root)),
    }


def found(folders: Sequence[Path], verifier: Verifier) -> list[dict[str, Any]]:
    """What a `PayloadFound` says of each folder. One that is read otherwise than anybody foresaw is
    refused (INTERNAL), and the others are judged all the same.

    Raises `DriveGone`.
    """
    return [_found(folder, verifier) for folder in folders]


def _certificates(root: Path) -> Iterator[str]:
    if _is_folder(root / CERTIFICATES):  # few drives have any: what reads them is big
        from nondum.host.jobs.certificates import certificates_on

        for data in certificates_on(root):
            if data.isascii():
                yield data.decode("ascii")


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:  # the file system is torn there; the payloads may be well
        return False


def copy(arguments: Arguments, report: Report) -> dict[str, int]:
    """Copy to staging what this host needs, once the metadata says that it fits.

    Raises `PayloadRefused`, `DriveGone`, `InstallFailed`.
    """
    folder, staging = Path(arguments["folder"]), Path(arguments["staging"])
    judged = judged_again(arguments)
    listed = judged.listed
    refuse_if_any(tuple(payload.oversized(listed)))
    drive.copy(folder, listed, staging, wanted=lambda e: payload.is_metadata(e.path))
    (staging / contents.NAME).write_bytes(judged.data)
    judged.keep_signature(staging)
    forked_trial.run(lambda: payload.load(staging, listed), listed.payload_id)
    staged = payload.load(staging, listed)
    facts = admitted(arguments, judged, staged)
    needed = chosen(staged, facts)
    known = known_wheels(arguments, staged, facts)
    data, stored = data_store(arguments), known_data(arguments, staged)
    missing = {locked.path for locked in needed if locked.sha256 not in known}
    missing |= {entry.path for entry in staged.data_files if entry not in stored}
    data.link(sorted(stored, key=lambda e: e.path), staging, partial(report, "check", 0, 1))
    pace = paced(report, str(folder))
    copied = drive.copy(folder, listed, staging, pace, wanted=lambda e: e.path in missing)
    known_bytes = sum(locked.size for locked in needed if locked.sha256 in known)
    return {"copied": copied, "known": known_bytes + sum(entry.size for entry in stored)}


@frozen
class Judged:
    """A payload's list on a drive, and what its signatures let it have."""

    data: bytes
    listed: Contents
    signature: bytes | None
    grant: Grant

    def keep_signature(self, folder: Path) -> None:
        """What is kept of a payload must say for itself why it was let in."""
        if self.signature is not None:
            (folder / contents.SIGNATURE_NAME).write_bytes(self.signature)
        else:
            (folder / contents.SIGNATURE_NAME).unlink(missing_ok=True)


def judged_again(arguments: Arguments) -> Judged:
    """The payload's list that was found before, judged by what is trusted now.

    Raises `PayloadRefused`, `DriveGone`.
    """
    folder = Path(arguments["folder"])
    data = drive.read_contents(folder)
    if hashlib.sha256(data).hexdigest() != arguments["digest"]:
        text = "the contents list is not the one that was read before"
        fix = "pull the drive and plug it in again"
        raise PayloadRefused(Problem("HASH_MISMATCH", text, where=str(folder), fix=fix))
    signature = drive.read_signature(folder)
    verdict = Rules.of(arguments).verifier().verify(data, signature)
    refuse_if_any(verdict.problems)
    listed = contents.parse(data, f"{folder.name}/{contents.NAME}")
    return Judged(data, listed, signature, verdict.grant)


def admitted(arguments: Arguments, judged: Judged, staged: StagedPayload) -> HostFacts:
    """What this host is, once a payload is found to fit and asks for nothing that is not granted.

    Raises `PayloadRefused`.
    """
    refuse_if_any(judged.grant.problems(staged.manifest, staged.goals))
    facts = facts_of(arguments)
    facts = replace(facts, memory=memory_for(arguments, facts))
    minimum = judged.listed.minimum_nondum
    refuse_if_any(preflight_problems(arguments, staged, facts, minimum_nondum=minimum))
    return facts


def preflight_problems(
    arguments: Arguments, staged: StagedPayload, facts: HostFacts, *, minimum_nondum: str = "0"
) -> tuple[Problem, ...]:
    """What keeps a payload from running here, with what this host's store has of it already."""
    stored: set[str] = set()
    if arguments["method"] != "pip":
        store = Store(Path(arguments["store"]))
        wheels = {wheel.sha256 for lock in staged.locks.values() for wheel in lock.wheels}
        stored = {sha256 for sha256 in wheels if store.has(sha256)}
    known = known_data(arguments, staged)
    return preflight.preflight(
        staged.manifest,
        staged.locks,
        facts,
        minimum_nondum=minimum_nondum,
        stored=stored,
        data_bytes=sum(entry.size for entry in staged.data_files if entry not in known),
    )


def verify(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Check the staged wheels and that nothing is missing; tell what each component's plugin says.

    Raises `PayloadRefused`.
    """
    facts = facts_of(arguments)
    staged = load_staged(Path(arguments["staging"]))
    stored = {
        sha256: _stored_layout(found)
        for sha256, found in known_wheels(arguments, staged, facts).items()
    }
    wrong_devices = payload.device_problems(staged)
    refuse_if_any((*payload.check_wheels(staged, facts, stored), *wrong_devices))
    ids = [component.id for component in staged.manifest.components]
    return {id: staged.index[id].to_dict() for id in ids}


def load_staged(folder: Path) -> StagedPayload:
    """A payload that `copy` has staged. Raises `PayloadRefused`."""
    return payload.load(
        folder, contents.parse((folder / contents.NAME).read_bytes(), contents.NAME)
    )


def facts_of(arguments: Arguments) -> HostFacts:
    """This host, as preflight looks at it."""
    return host_facts.probe(
        Path(arguments["store"]),
        reserve_mb=arguments["reserve_mb"],
        confinement=confinement.parse(arguments["confinement"]),
        most=WorkerLimits(**arguments.get("most", {})),
    )


def memory_for(arguments: Arguments, facts: HostFacts) -> Memory:
    """This host's memory for a payload: with that of a release which it takes over from, and less
    what is reserved for other payloads."""
    headroom = arguments["headroom"]
    have = replace(facts.memory, promised=Promised.parse(headroom["promised"]))
    return have.with_freed(headroom["freed_mb"], headroom["freed_gpu_mb"])


def chosen(staged: StagedPayload, facts: HostFacts) -> tuple[LockedWheel, ...]:
    """Every wheel that this host needs of a payload, each once, largest first."""
    wheels = {w.sha256: w for group in staged.wheels(facts).values() for w in group}
    return tuple(sorted(wheels.values(), key=lambda w: -w.size))


def known_wheels(
    arguments: Arguments, staged: StagedPayload, facts: HostFacts
) -> dict[str, StoredWheel]:
    """What the store has of them, by hash; pip does not read from the store."""
    if arguments["method"] == "pip":
        return {}
    store = Store(Path(arguments["store"]))
    found = {wheel.sha256: store.get(wheel.sha256) for wheel in chosen(staged, facts)}
    return {sha256: stored for sha256, stored in found.items() if stored is not None}


def data_store(arguments: Arguments) -> DataStore:
    """Where this host keeps data: beside its wheels."""
    return DataStore(Path(arguments["store"]).with_name("data"))


def known_data(arguments: Arguments, staged: StagedPayload) -> frozenset[Entry]:
    """The files of a payload's data that this host has."""
    store = data_store(arguments)
    return frozenset(entry for entry in staged.data_files if store.has(entry))


def _found(folder: Path, verifier: Verifier) -> dict[str, Any]:
    digest = ""
    listed: Contents | None = None
    problems: tuple[Problem, ...] = ()
    verdict = Verdict(())
    try:
        data, where = drive.read_contents(folder), f"{folder.name}/{contents.NAME}"
        digest = hashlib.sha256(data).hexdigest()
        signature = drive.read_signature(folder)
        verdict = verifier.verify(data, signature)
        problems = verdict.problems
        if not problems:
            listed = contents.parse(data, where)
            problems = tuple(_version_problems(listed))
        elif signature is None and (flaw := contents.begins_wrong(data, where)) is not None:
            problems = (*problems, flaw)  # to sign it would not help
    except PayloadRefused as error:
        problems = error.problems
    except (NondumError, OSError, MemoryError):
        raise  # that is the drive's, or this host's
    except Exception as error:
        traceback.print_exc()
        problems = (verification.unforeseen(error, folder),)
    # Two folders without a readable list are two payloads, wherever they are.
    name = digest or hashlib.sha256(str(folder).encode()).hexdigest()
    return {
        "payload": payload_key.key_of(name),
        "folder": str(folder),
        "digest": digest,
        "payload_id": listed.payload_id if listed else folder.name,
        "version": listed.version if listed else "",
        "release": listed.release if listed else 0,
        "fleet": listed.fleet if listed else "",
        "built": listed.built if listed else "",
        "problems": [problem.to_dict() for problem in brief(problems)],
        "warnings": [problem.to_dict() for problem in verdict.warnings],
        "signers": list(verdict.signers),
        "grant": verdict.grant.to_dict(),
    }


def _version_problems(listed: Contents) -> Iterator[Problem]:
    have = host_facts.nondum_version()
    if Version(listed.minimum_nondum) > Version(have):
        yield Problem(
            "NONDUM_VERSION",
            "the payload needs a newer nondum",
            where=listed.payload_id,
            need=listed.minimum_nondum,
            have=have,
            fix="update this host",
        )


def _stored_layout(stored: StoredWheel) -> Layout:
    """What is known of a wheel that was judged when it was stored."""
    found = distributions(path=[str(stored.root)])
    requirements = tuple(line for distribution in found for line in distribution.requires or ())
    return Layout((), stored.left_out, (), Needs(requirements))


def refuse_if_any(problems: tuple[Problem, ...] | list[Problem]) -> None:
    if problems:
        raise PayloadRefused(*problems)
