"""Commands about whom one host trusts."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nondum.host.cli import render
from nondum.host.cli.connection import Session, json_option

if TYPE_CHECKING:
    from nondum.wheelhouse.trust.succession import SignedFile
    from nondum.wheelhouse.trust.trust import Trust, TrustedKey


@click.command("list")
@click.argument("file", required=False, type=click.Path(path_type=Path, dir_okay=False))
@json_option
@click.pass_obj
def list_keys(session: Session, file: Path | None) -> None:
    """Show whom the host trusts, or what the trust file FILE says.

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
        click.echo("nobody is trusted: nondum keys trust FILE")
    else:
        _show(trust)


@click.command()
@click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--yes", is_flag=True, help="Do not ask.")
@json_option
@click.pass_obj
def trust(session: Session, file: Path, yes: bool) -> None:
    """Have the host go by a trust file: its first one, or the next versions.

    For the first one, compare the fingerprints with the owner's; to write it may need root. Later
    ones are taken as their roots have signed them; those between lie beside FILE.

    Example: sudo nondum keys trust /media/usb/nondum-trust/trust.toml
    """
    from nondum.wheelhouse.trust import owners_folder

    row = session.ask("trust")
    if not row["version"]:
        row = _begin(session, owners_folder.read(file), Path(row["anchor"]), is_sure=yes)
    else:
        version = row["version"]
        for signed in owners_folder.versions(file):
            if _version(signed) > version or file == Path(signed.where):
                row = _give(session, signed)
    if session.as_json:
        render.as_json(row)
    else:
        click.echo(f"trusted: version {row['version']}")


def _begin(session: Session, file: SignedFile, anchor: Path, *, is_sure: bool) -> Any:
    """Write the first trust file where the host reads it."""
    from nondum.wheelhouse import disk
    from nondum.wheelhouse.trust import succession

    first = succession.check_first(file)
    if not (is_sure or session.as_json):
        for root in first.roots.keys:
            click.echo(f"root {root.name}  {root.key.fingerprint}")
        click.confirm(f"Are these the keys of {first.owner}?", abort=True)
    anchor.parent.mkdir(parents=True, exist_ok=True)
    disk.write(anchor, file.data)
    anchor.chmod(0o644)
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
        may = ", ".join(role.permissions) or "nothing more"
        who = f"{role.threshold} of {', '.join(role.keys)}"
        click.echo(f"role {role.name}: {', '.join(role.payloads)} by {who}; may have {may}")
    for revocation in trust.revoked:
        render.sentence(f"revoked {revocation.fingerprint}  {revocation.why}".rstrip())


def _day(moment: datetime | None) -> str:
    return f"{moment:%Y-%m-%d}" if moment is not None else ""
