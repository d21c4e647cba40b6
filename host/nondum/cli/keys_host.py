"""Commands about the trust file of one host."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.cli import render
from nondum.cli.config import which_options
from nondum.cli.connection import json_option
from nondum.cli.session import Session
from nondum.host.config.effective import Asked, effective
from nondum.host.core.printable import printable
from nondum.sdk.errors import Problem, TrustRefused

if TYPE_CHECKING:
    from nondum.wheelhouse.trust.succession import SignedFile
    from nondum.wheelhouse.trust.trust import Trust, TrustedKey


@click.command("list")
@click.argument("file", required=False, type=click.Path(path_type=Path, dir_okay=False))
@json_option
@click.pass_obj
def list_keys(session: Session, file: Path | None) -> None:
    """Show the signers that the host trusts, or those in the trust file FILE.

    Example: nondum keys list
    """
    from nondum.wheelhouse.trust import owners_folder, trust_file

    row: dict[str, Any] = {}
    if file is not None:
        trust: Trust | None = owners_folder.parsed(file)
    else:
        row = session.ask("trust")
        trust = trust_file.parse(row["file"], trust_file.NAME) if row["version"] else None
    if session.as_json:
        render.as_json({**row, **(_view(trust) if trust is not None else {})})
        return
    for warning in row.get("warnings", ()):
        render.sentence(warning, colour="yellow", mark="warning: ")
    if trust is None:
        click.echo("no signer is trusted: nondum keys trust FILE")
        return
    if row:
        render.sentence(f"the first trust file, {row['anchor']}, is {row['first']}")
    _show(trust)


@click.command()
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@which_options
@click.option("--yes", is_flag=True, help="Do not ask.")
@json_option
@click.pass_obj
def trust(session: Session, file: Path, user: bool, config_file: Path | None, yes: bool) -> None:
    """Have the host go by a trust file: its first one, or the next versions.

    The first one must be signed by its own roots: compare their fingerprints with what the owner
    says, and read which payloads the other keys may bring. It is written where this host's
    configuration says (`file` under [trust]), which needs root. Later ones are taken as their roots
    have signed them; those between lie beside FILE.

    \b
    Examples: sudo nondum keys trust /media/usb/nondum-trust/trust.toml
              nondum keys trust --user trust.toml
    """
    from nondum.wheelhouse.trust import owners_folder

    row = session.ask("trust")
    if not row["version"]:
        anchor = _anchor(Asked(user, config_file), row["anchor"])
        row = _begin(session, owners_folder.read(file), anchor, is_sure=yes)
    else:
        version = row["version"]
        for signed in owners_folder.versions(file):
            if _version(signed) > version or file == Path(signed.where):
                row = _give(session, signed)
    if session.as_json:
        render.as_json(row)
    else:
        click.echo(f"trusted: version {row['version']}")


def _anchor(asked: Asked, told: str) -> Path:
    """Where the host reads its first trust file, by a configuration that belongs to the caller. The
    daemon, which may be an attacker's by now, only says whether it is the same place.

    Raises `TrustRefused` (TRUST_ELSEWHERE), `ConfigRefused`.
    """
    anchor = effective(asked).first_trust_file
    if str(anchor) != told:
        raise TrustRefused(
            Problem(
                "TRUST_ELSEWHERE",
                "the host that answers reads its first trust file at another place",
                where=str(anchor),
                need=str(anchor),
                have=told,
                fix="name the configuration that it runs with: --config FILE, or --user",
            )
        )
    return anchor


def _begin(session: Session, file: SignedFile, anchor: Path, *, is_sure: bool) -> Any:
    """Write the first trust file where the host reads it."""
    from nondum.host.trust import anchors
    from nondum.wheelhouse.trust import succession

    first = succession.first(file)
    if not (is_sure or session.as_json):
        _show(first)
        click.confirm(
            f"Are the roots above the keys of {first.owner}, all of them and no others?", abort=True
        )
    anchors.place(anchor, file)
    return session.ask("trust_reload")


def _version(file: SignedFile) -> int:
    from nondum.wheelhouse.trust import trust_file

    return trust_file.parse_bytes(file.data, file.where).version


def _give(session: Session, file: SignedFile) -> Any:
    signature = file.signature.decode("ascii", "replace") if file.signature is not None else None
    return session.ask("trust_give", file=file.data.decode(), signature=signature)


def _view(trust: Trust) -> dict[str, Any]:
    return {
        "owner": trust.owner,
        "version": trust.version,
        "made": _day(trust.made),
        "fleets": list(trust.fleets),
        "roots": [_row(root) for root in trust.roots.keys],
        "threshold": trust.roots.threshold,
        "keys": [_row(key) for key in trust.keys],
        "roles": [
            {
                "role": role.name,
                "payloads": list(role.payloads),
                "keys": list(role.keys),
                "threshold": role.threshold,
                "permissions": list(role.permissions),
                "most": role.most.given(),
            }
            for role in trust.roles
        ],
        "revoked": [{"fingerprint": r.fingerprint, "why": r.why} for r in trust.revoked],
    }


def _row(key: TrustedKey) -> dict[str, Any]:
    return {
        "name": key.name,
        "fingerprint": key.key.fingerprint,
        "kind": key.key.kind,
        "since": _day(key.since),
        "until": _day(key.until),
    }


def _show(trust: Trust) -> None:
    click.echo(f"{trust.owner}  version {trust.version}, made {_day(trust.made)}")
    if trust.fleets:
        click.echo(f"fleets: {', '.join(trust.fleets)}")
    for root in trust.roots.keys:
        click.echo(f"root {root.name}  {root.key.fingerprint}")
    click.echo(f"{trust.roots.threshold} of them change this")
    now = datetime.now(UTC)
    for key in trust.keys:
        gone = trust.revocation(key.key) is not None
        ended = key.until is not None and key.until <= now
        state = "  revoked" if gone else "  ended" if ended else ""
        until = f"  until {_day(key.until)}" if key.until is not None else ""
        click.echo(f"key {key.name}  {key.key.fingerprint}{until}{state}")
    for role in trust.roles:
        bounds = [f"at most {key} = {most}" for key, most in role.most.given().items()]
        may = ", ".join((*role.permissions, *bounds)) or "nothing more"
        who = f"{role.threshold} of {', '.join(role.keys)}"
        click.echo(f"role {role.name}: {', '.join(role.payloads)} by {who}; may have {may}")
    for revocation in trust.revoked:
        click.echo(printable(f"revoked {revocation.fingerprint}  {revocation.why}".rstrip()))


def _day(moment: datetime | None) -> str:
    return f"{moment:%Y-%m-%d}" if moment is not None else ""
