"""The trust files of a host, from the first one to the active one, as they lie on its disk; what
child processes do with them.

    /etc/nondum/trust.toml            the first one, and its signatures: see `anchors`
    <state>/trust/00000004.toml       each that followed, by its version
    <state>/trust/00000004.toml.sig   what its roots have signed it with

Nothing in `<state>/trust` is believed for lying there: the chain is verified at each start.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from nondum.host.trust import anchors
from nondum.host.trust.rules import Rules, parsed
from nondum.sdk.errors import NondumError, PayloadRefused, Problem
from nondum.wheelhouse.format import contents
from nondum.wheelhouse.format.manifest import Manifest
from nondum.wheelhouse.format.signatures import Grant, Verdict
from nondum.wheelhouse.store import disk
from nondum.wheelhouse.trust import succession
from nondum.wheelhouse.trust.succession import SignedFile

Report = Callable[[str, int, int], None]
Arguments = Mapping[str, Any]


def load(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Follow the chain in `folder` from its first file, `anchor`: the active `text` (None: no key
    is trusted), the `origin` of the first file, the digests `known` and the `problems` on the way.
    """
    folder = Path(arguments["folder"])
    try:
        anchor = anchors.load(Path(arguments["anchor"]))
    except NondumError as refused:
        return _told([], () if refused.code == "TRUST_MISSING" else refused.problems)
    first, trust, origin = anchor.file, anchor.trust, anchor.origin.value
    try:
        updates = tuple(_updates(folder, trust.version))
    except NondumError as refused:
        return _told([first], refused.problems, origin)
    extended = succession.extend(trust, (first.digest,), updates)
    return _told([first, *extended.accepted], extended.problems, origin)


def extend(arguments: Arguments, report: Report) -> dict[str, Any]:
    """Take from the files `offered` (see `packed`) those that follow the active `trust`, and keep
    them in `folder`: as `load`, with `taken`, the versions.

    Raises `InstallFailed` (DISK_FULL, …); then the active trust stays.
    """
    folder, known = Path(arguments["folder"]), list(arguments["known"])
    offered = unpacked(arguments["offered"])
    current = parsed(arguments["trust"])
    extended = succession.extend(current, known, offered)
    for version, file in enumerate(extended.accepted, start=current.version + 1):
        _keep(folder, _name(version), file)
    text = extended.accepted[-1].data.decode() if extended.accepted else arguments["trust"]
    return {
        "text": text,
        "known": [*known, *(file.digest for file in extended.accepted)],
        "problems": [problem.to_dict() for problem in extended.problems],
        "taken": list(range(current.version + 1, extended.trust.version + 1)),
    }


def judge_kept(arguments: Arguments, report: Report) -> dict[str, dict[str, Any]]:
    """Judge payloads by what is kept of them in `folders`: key → its `signers`, when it was `built`
    and its `problems`."""
    return {
        folder.name: _told_of(arguments, folder)
        for folder in map(Path, arguments["folders"])
        if folder.exists()
    }


def _told_of(arguments: Arguments, folder: Path) -> dict[str, Any]:
    verdict = _judged(arguments, folder)
    return {
        "signers": list(verdict.signers),
        "built": contents.parse((folder / contents.NAME).read_bytes(), contents.NAME).built,
        "problems": [problem.to_dict() for problem in verdict.problems],
    }


def grant_of_kept(
    arguments: Arguments, folder: Path, manifest: Manifest, goals: Sequence[str] = ()
) -> Grant:
    """What a payload may have, judged by what is kept of it; whether its keys hold now was asked as
    it came.

    Raises `PayloadRefused`, but where what is here may go on without trust.
    """
    verdict = _judged(arguments, folder)
    problems = verdict.problems or verdict.grant.problems(manifest, goals)
    if problems and arguments.get("demand_trust", True):
        raise PayloadRefused(*problems)
    return verdict.grant


def _judged(arguments: Arguments, folder: Path) -> Verdict:
    signature = folder / contents.SIGNATURE_NAME
    return (
        Rules.of(arguments)
        .verifier(with_time=False)
        .verify(
            (folder / contents.NAME).read_bytes(),
            signature.read_bytes() if signature.exists() else None,
        )
    )


def packed(files: tuple[SignedFile, ...]) -> list[list[str | None]]:
    """Files as they travel between processes."""
    return [[_base64(f.data), _base64(f.signature), f.where] for f in files]


def unpacked(rows: list[list[str | None]]) -> tuple[SignedFile, ...]:
    """The same, back again."""
    return tuple(
        SignedFile(
            base64.b64decode(data or ""),
            base64.b64decode(signature) if signature is not None else None,
            where or "",
        )
        for data, signature, where in rows
    )


def _base64(data: bytes | None) -> str | None:
    return base64.b64encode(data).decode("ascii") if data is not None else None


def _told(
    known: Sequence[SignedFile], problems: Sequence[Problem], origin: str = ""
) -> dict[str, Any]:
    return {
        "text": known[-1].data.decode() if known else None,
        "origin": origin,
        "known": [file.digest for file in known],
        "problems": [problem.to_dict() for problem in problems],
    }


def _updates(folder: Path, after: int) -> Iterator[SignedFile]:
    names = sorted(path.name for path in folder.glob("????????.toml")) if folder.is_dir() else []
    for name in names:
        if name > _name(after):
            yield anchors.read(folder / name)


def _keep(folder: Path, name: str, file: SignedFile) -> None:
    """Write the signatures, then the file: one without the other is never found.

    Raises `InstallFailed`.
    """
    try:
        disk.make_folder(folder)
        if file.signature is not None:
            disk.write(folder / (name + anchors.SIGNATURE_SUFFIX), file.signature)
        disk.write(folder / name, file.data)
    except OSError as error:
        raise disk.failed(error, "the trust file cannot be kept", folder / name) from error


def _name(version: int) -> str:
    return f"{version:08d}.toml"
