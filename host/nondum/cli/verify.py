"""`payload verify`, which judges as hosts do, and `payload check`, which authors run before they
sign."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.failure import EXIT_PROBLEMS
from nondum.cli.judge import FOLDER, payloads, signed
from nondum.cli.machine import this_machine
from nondum.cli.progress import ProgressLine
from nondum.cli.session import Session
from nondum.sdk.errors import HostUnreachable, NondumError, PayloadRefused, Problem

if TYPE_CHECKING:
    from nondum.wheelhouse.build.verification import Verified
    from nondum.wheelhouse.format.signatures import Verifier
    from nondum.wheelhouse.payload.host_facts import HostFacts
    from nondum.wheelhouse.trust.trust import Trust

FILE = click.Path(path_type=Path, exists=True, dir_okay=False)


@click.command()
@click.argument("drive", type=FOLDER)
@click.option("--trust", type=FILE, help="Trust file to judge by [default: the host's].")
@click.option("--unsigned", is_flag=True, help="Do not ask for signatures; those there must hold.")
@click.option("--arch", help="For hosts of this architecture, as aarch64 [default: this machine].")
@click.option("--python", help="For hosts with this Python, as 3.12.")
@click.option("--anywhere", is_flag=True, help="Do not ask whether it fits a machine.")
@json_option
@click.pass_obj
def verify(
    session: Session,
    drive: Path,
    trust: Path | None,
    unsigned: bool,
    arch: str | None,
    python: str | None,
    anywhere: bool,
) -> int:
    """Judge a drive or payload folder as a host would: signatures, files, locks and wheels.

    All problems are told, also what a host would not come to after the first. Exits with 3 on
    problems. Without a trust file, and where no host runs, the one in /etc/nondum is judged by.

    Whether it fits is asked of this machine as it is now: disk, memory, and the level at which the
    host that runs here confines workers; where none runs, the best level that you could have. With
    --arch or --python it is asked of any such host, which has enough of all that; with --anywhere
    it is not asked.

    \b
    Examples: nondum payload verify /media/usb
              nondum payload verify drive --trust trust.toml --arch aarch64 --python 3.12 --json
    """
    facts = None if anywhere else _facts(session, arch, python)
    trusted = _trusted(session, trust)
    verifier = _verifier(trusted, unsigned=unsigned)
    return _tell(session, drive, verifier, facts, trusted)


@click.command()
@click.argument("drive", type=FOLDER)
@click.option("--anywhere", is_flag=True, help="Do not ask whether it fits this machine.")
@json_option
@click.pass_obj
def check(session: Session, drive: Path, anywhere: bool) -> int:
    """Judge what was built, before it is signed: all that `verify` does but for signatures.

    Exits with 3 on problems. Whether it fits is asked of this machine, as `verify` does.

    \b
    Examples: nondum payload check /media/usb
              nondum payload check drive --anywhere --json
    """
    facts = None if anywhere else _facts(session, None, None)
    trusted = _trusted(session, None)
    return _tell(session, drive, _verifier(None, unsigned=True), facts, trusted)


def _tell(
    session: Session,
    drive: Path,
    verifier: Verifier,
    facts: HostFacts | None,
    trust: Trust | None,
) -> int:
    """Judge all payloads of a drive, tell what was found, and give the exit code. Signers are
    called as `trust` has them."""
    problems: list[Problem] = []
    warnings: list[Problem] = []
    signers: dict[str, list[str]] = {}
    signed_by: dict[str, str] = {}
    try:
        folders = list(payloads(drive))
    except PayloadRefused as refused:
        folders, problems = [], list(refused.problems)
    for folder in folders:
        with ProgressLine(folder.name, is_wanted=not session.as_json) as show:
            found = _verified(folder, verifier, facts, show)
        problems += found.problems
        warnings += found.warnings
        signers[folder.name], signed_by[folder.name] = _signers(folder, trust)
    if session.as_json:
        told_all = {"ok": not problems, "problems": _rows(problems), "warnings": _rows(warnings)}
        render.as_json({**told_all, "signers": signers})
    else:
        for name, told in signed_by.items():
            render.sentence(f"{name}: {told}")
        for problem in problems:
            render.sentence(str(problem), colour="red")
        for warning in warnings:
            render.sentence(str(warning), colour="yellow", mark="warning: ")
        click.echo("refused" if problems else "accepted")
    return EXIT_PROBLEMS if problems else 0


def _signers(folder: Path, trust: Trust | None) -> tuple[list[str], str]:
    """The keys of the valid signatures of a payload, and a sentence about them."""
    try:
        keys: list[str] = signed(folder, trust)["signers"]
    except NondumError:  # its list cannot be read, which is told as a problem
        keys = []
    if keys:
        return keys, f"signed by {', '.join(keys)}"
    from nondum.wheelhouse.format import contents

    is_signed = (folder / contents.SIGNATURE_NAME).exists()
    return keys, "no signature of it holds" if is_signed else "no one has signed it"


def _rows(problems: Iterable[Problem]) -> list[dict[str, str]]:
    """Problems with the four keys that programs count on, and what else there is."""
    always = {"code": "", "where": "", "message": "", "fix": ""}
    return [{**always, **problem.to_dict()} for problem in problems]


def _verified(
    folder: Path, verifier: Verifier, facts: HostFacts | None, show: ProgressLine
) -> Verified:
    from dataclasses import replace

    from nondum.host.trust import vocabulary_check
    from nondum.wheelhouse.build import verification

    found = verification.verify(folder, verifier, facts, show)
    if found.payload is None:
        return found
    judged = vocabulary_check.judge(found.payload.index)
    return replace(
        found,
        problems=(*found.problems, *judged.problems),
        warnings=(*found.warnings, *judged.warnings),
    )


def _facts(session: Session, arch: str | None, python: str | None) -> HostFacts:
    """The host that is asked about: this machine, or any of the kind that is named."""
    from nondum.wheelhouse.format.target import Target, targets
    from nondum.wheelhouse.payload import host_facts

    if arch is None and python is None:
        return this_machine(session)
    here = Target.here()
    (target,) = targets((arch or here.architecture,), (python or here.python,))
    return host_facts.of_target(target)


def _trusted(session: Session, file: Path | None) -> Trust | None:
    """The trust file that is named, the running host's, or the one that one would begin with."""
    from nondum.host.config.host_config import HostConfig
    from nondum.host.trust import anchors
    from nondum.wheelhouse.trust import owners_folder, trust_file

    if file is not None:
        return owners_folder.parsed(file)
    try:
        row: dict[str, Any] = session.ask("trust")
    except HostUnreachable:
        anchor = HostConfig().first_trust_file
        return anchors.load(anchor).trust if anchor.exists() else None
    return trust_file.parse(row["file"], trust_file.NAME) if row["version"] else None


def _verifier(trust: Trust | None, *, unsigned: bool) -> Verifier:
    from nondum.wheelhouse.trust.judging import Circumstances, Developing, Judging

    at = Circumstances(now=datetime.now(UTC))
    return Developing(trust, at) if unsigned else Judging(trust, at)
