"""A payload on its way to another host or from one, in a child process: files are copied for it to
fetch, and what it offers is judged as what lies on a drive is."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from nondum.host.jobs import forked_trial, look
from nondum.host.jobs.read_pace import paced
from nondum.host.jobs.table import Arguments, Report
from nondum.host.sandbox.helper import privileged
from nondum.host.trust import chain
from nondum.sdk.errors import InstallFailed, PayloadRefused, Problem
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.contents import Contents, Entry
from nondum.wheelhouse.payload import drive, payload, preflight

_MB = 1024 * 1024


def hand_over(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Copy from a drive to `target` what another host is to fetch: the files whose hashes are
    `wanted`, or, where that is None, all metadata, with the contents list and its signature.

    Raises `PayloadRefused`, `DriveGone`, `InstallFailed` (DISK_FULL, …).
    """
    root, target = Path(arguments["root"]), Path(arguments["target"])
    if arguments["node"] is not None:
        node, drive_name = Path(arguments["node"]), arguments["drive"]
        root = privileged().mount(node, root, arguments["filesystem"], drive_name, "handover")
    folder = root / arguments["folder"]
    data = drive.read_contents(folder)
    if hashlib.sha256(data).hexdigest() != arguments["digest"]:
        text = "the contents list is not the one that was read before"
        fix = "pull the drive and plug it in again"
        raise PayloadRefused(Problem("HASH_MISMATCH", text, where=folder.name, fix=fix))
    listed = contents.parse(data, f"{folder.name}/{contents.NAME}")
    wanted = _wanted(listed, arguments["wanted"])
    _check_space(target, wanted, arguments["reserve_mb"])
    for entry in wanted:  # what a former attempt left
        (target / entry.path).unlink(missing_ok=True)
    drive.copy(
        folder, listed, target, paced(report, str(folder)), wanted=lambda entry: entry in wanted
    )
    if arguments["wanted"] is None:
        (target / contents.NAME).write_bytes(data)
        signature = drive.read_signature(folder)
        if signature is not None:
            (target / contents.SIGNATURE_NAME).write_bytes(signature)
    return {"files": [[entry.sha256, entry.path] for entry in wanted], "contents": len(data)}


def outline(arguments: Arguments, report: Report) -> list[list[Any]]:
    """The files that a payload is judged by: path, hash and size of each, from its contents list.

    Raises `PayloadRefused`.
    """
    listed = _listed(Path(arguments["folder"]))
    if problems := tuple(payload.oversized(listed)):
        raise PayloadRefused(*problems)
    found = [entry for entry in listed.entries if payload.is_metadata(entry.path)]
    return [_row(entry) for entry in found]


def judge(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Whether a payload, of which the metadata is in `folder`, would run here: the files that are
    still `needed`, path, hash and size of each wheel and file of data that this host has not.

    Raises `PayloadRefused` with all that keeps it from running here.
    """
    folder = Path(arguments["folder"])
    listed = _listed(folder)
    forked_trial.run(lambda: payload.load(folder, listed), listed.payload_id)
    staged = payload.load(folder, listed)
    chain.grant_of_kept({**arguments, "demand_trust": True}, folder, staged.manifest)
    facts = look.facts_of(arguments)
    facts = replace(facts, memory=look.memory_for(arguments, facts))
    minimum = listed.minimum_nondum
    look.refuse_if_any(look.preflight_problems(arguments, staged, facts, minimum_nondum=minimum))
    known, stored = look.known_wheels(arguments, staged, facts), look.known_data(arguments, staged)
    missing = {w.path for w in look.chosen(staged, facts) if w.sha256 not in known}
    missing |= {entry.path for entry in staged.data_files if entry not in stored}
    needed = [entry for entry in listed.entries if entry.path in missing]
    fetched_mb = sum(entry.size for entry in needed) // _MB
    beside = replace(facts, free_disk_mb=max(0, facts.free_disk_mb - fetched_mb))
    look.refuse_if_any(look.preflight_problems(arguments, staged, beside))
    return {"needed": [_row(entry) for entry in needed]}


def _listed(folder: Path) -> Contents:
    return contents.parse(drive.read_contents(folder), f"{folder.name}/{contents.NAME}")


def _wanted(listed: Contents, hashes: Collection[str] | None) -> tuple[Entry, ...]:
    if hashes is None:
        return tuple(entry for entry in listed.entries if payload.is_metadata(entry.path))
    return tuple(entry for entry in listed.entries if entry.sha256 in hashes)


def _check_space(target: Path, wanted: Collection[Entry], reserve_mb: int) -> None:
    target.mkdir(parents=True, exist_ok=True)
    need = sum(entry.size for entry in wanted)
    have = shutil.disk_usage(target).free - reserve_mb * _MB
    if need > have:
        raise InstallFailed(
            Problem(
                "DISK_FULL",
                "there is too little disk to copy it for another host",
                where=str(target),
                need=f"{need // _MB + 1} MB",
                have=preflight.free_beside(max(0, have) // _MB, reserve_mb),
                fix="free some disk, or plug the drive into the other host",
            )
        )


def _row(entry: Entry) -> list[Any]:
    return [entry.path, entry.sha256, entry.size]
