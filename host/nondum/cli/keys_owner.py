"""Commands for owners of robots: keys and the trust file, on a machine that needs no daemon."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nondum.cli import render
from nondum.cli.connection import json_option
from nondum.cli.session import Session

if TYPE_CHECKING:
    from nondum.wheelhouse.trust.public_key import PublicKey
    from nondum.wheelhouse.trust.trust import Trust, TrustedKey

FILE = click.Path(path_type=Path, dir_okay=False)
_until = click.option(
    "--until", type=click.DateTime(["%Y-%m-%d"]), help="Day on which it ends, UTC [default: never]."
)


@click.command()
@click.argument("file", type=FILE)
@click.option("--comment", default="", help="Whose it is.")
@click.option("--fido", is_flag=True, help="Keep the secret in a FIDO token.")
@click.option("--passphrase", is_flag=True, help="Lock it with a passphrase, which is asked for.")
@json_option
@click.pass_obj
def new(session: Session, file: Path, comment: str, fido: bool, passphrase: bool) -> None:
    """Make a key: FILE is secret, FILE.pub is not.

    Any Ed25519 key that ssh-keygen made serves as well, in a file, an agent or a token.

    \b
    Examples: nondum keys new alice --passphrase
              nondum keys new alice --fido
    """
    from nondum.wheelhouse.trust import signing

    key = signing.make_key(file, comment, fido=fido, passphrase=passphrase)
    if session.as_json:
        told = {"file": str(file), "fingerprint": key.fingerprint, "key": key.line}
        render.as_json(told)
        return
    click.echo(f"{file}  secret")
    click.echo(f"{file}.pub  public: {key.fingerprint}")


@click.command()
@click.argument("file", type=FILE)
@click.option("--owner", required=True, help="Who owns the robots: a name.")
@click.option(
    "--root", "roots", multiple=True, required=True, help="Key that may change it: a .pub file."
)
@click.option("--threshold", type=click.IntRange(1), default=1, help="How many of them must sign.")
@click.option("--signer", "signers", multiple=True, help="Key of payloads [default: the roots].")
@click.option("--fleet", "fleets", multiple=True, help="Fleet that the robots belong to.")
@json_option
@click.pass_obj
def init(
    session: Session,
    file: Path,
    owner: str,
    roots: tuple[str, ...],
    threshold: int,
    signers: tuple[str, ...],
    fleets: tuple[str, ...],
) -> None:
    """Begin a trust file: FILE, version 1. Its signers may bring any payload.

    \b
    Examples: nondum keys init trust.toml --owner survey --root alice.pub
              nondum keys init trust.toml --owner survey --root a.pub --root b.pub --root c.pub
                --threshold 2 --signer release.pub --fleet survey
    """
    from nondum.wheelhouse.trust import editing, owners_folder

    trust = editing.begun(
        owner,
        [_named(root) for root in roots],
        [_named(signer) for signer in signers or roots],
        threshold=threshold,
        fleets=fleets,
        made=_now(),
    )
    owners_folder.create(file, trust)
    _tell(session, file, trust)


@click.command()
@click.argument("file", type=FILE)
@click.argument("key")
@click.option("--name", help="What to call the key [default: as its file].")
@click.option(
    "--payloads", multiple=True, required=True, help="Beginning of the ids it may bring; *: any."
)
@click.option("--permission", "permissions", multiple=True, help="What they may ask for; *: all.")
@click.option("--role", help="Role that it is in [default: as its name].")
@_until
@json_option
@click.pass_obj
def allow(
    session: Session,
    file: Path,
    key: str,
    name: str | None,
    payloads: tuple[str, ...],
    permissions: tuple[str, ...],
    role: str | None,
    until: datetime | None,
) -> None:
    """Let KEY, a .pub file or its line, bring payloads.

    Example: nondum keys allow trust.toml acme.pub --payloads com.acme --permission network
    """
    from nondum.wheelhouse.trust import editing
    from nondum.wheelhouse.trust.trust import Role, TrustedKey

    called = name or _called(key)
    known = TrustedKey(called, _public(key), None, _end(until))
    added = Role(role or called, payloads, (called,), permissions=permissions)
    _edit(session, file, lambda trust: editing.allowed(trust, known, added))


@click.command()
@click.argument("file", type=FILE)
@click.argument("key")
@click.option("--why", default="", help="What happened.")
@json_option
@click.pass_obj
def revoke(session: Session, file: Path, key: str, why: str) -> None:
    """Never believe KEY again: its name in FILE, its fingerprint, or its .pub file.

    Example: nondum keys revoke trust.toml acme --why "laptop stolen"
    """
    from nondum.wheelhouse.trust import editing

    def change(trust: Trust) -> Trust:
        is_public = Path(key).is_file() or " " in key
        meant = _public(key) if is_public else editing.found(trust, key)
        return editing.revoked(trust, meant, why)

    _edit(session, file, change)


@click.command()
@click.argument("file", type=FILE)
@click.argument("name")
@click.argument("key")
@_until
@json_option
@click.pass_obj
def rotate(session: Session, file: Path, name: str, key: str, until: datetime | None) -> None:
    """Put a new KEY in the place of the one called NAME, root or not.

    Signatures of the old key are not valid any more: sign again what it has signed.

    Example: nondum keys rotate trust.toml alice alice-2027.pub
    """
    from nondum.wheelhouse.trust import editing

    public = _public(key)
    _edit(session, file, lambda trust: editing.rotated(trust, name, public, until=_end(until)))


@click.command()
@click.argument("file", type=FILE)
@click.option("--key", type=FILE, required=True, help="A root's: its file, or .pub for the agent.")
@json_option
@click.pass_obj
def sign(session: Session, file: Path, key: Path) -> None:
    """Sign a trust file as one of its roots. A version that was signed is not changed any more.

    Example: nondum keys sign trust.toml --key alice
    """
    from nondum.wheelhouse.trust import owners_folder

    _tell(session, file, owners_folder.sign(file, key))


def _edit(session: Session, file: Path, change: Callable[[Trust], Trust]) -> None:
    from nondum.wheelhouse.trust import owners_folder

    _tell(session, file, owners_folder.edit(file, change, _now()))


def _tell(session: Session, file: Path, trust: Trust) -> None:
    """Say how far a trust file is."""
    from nondum.wheelhouse.trust import owners_folder

    missing = owners_folder.still_missing(file)
    if session.as_json:
        render.as_json({"file": str(file), "version": trust.version, "missing": list(missing)})
        return
    click.echo(f"{file}  version {trust.version} of {trust.owner}")
    for sentence in missing:
        click.echo(f"to be signed by {sentence}: nondum keys sign {file} --key KEY")
    if not missing:
        folder = file.parent
        click.echo(f"signed; for robots: copy {folder}/{file.stem}*.toml* to DRIVE/nondum-trust/")


def _named(key: str) -> TrustedKey:
    from nondum.wheelhouse.trust.trust import TrustedKey

    return TrustedKey(_called(key), _public(key))


def _called(key: str) -> str:
    """The name of a key's file."""
    if " " in key:
        raise click.UsageError("say what to call the key: --name")
    return Path(key).stem.lower()


def _public(key: str) -> PublicKey:
    """A key by its `.pub` file or line."""
    from nondum.wheelhouse.trust import signing

    return signing.parse_public(key, "KEY") if " " in key else signing.read_public(Path(key))


def _now() -> datetime:
    return datetime.now(UTC).replace(microsecond=0)


def _end(day: datetime | None) -> datetime | None:
    return day.replace(tzinfo=UTC) if day is not None else None
