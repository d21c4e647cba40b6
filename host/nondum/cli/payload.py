"""Commands that make and install payloads. Making one needs no host."""

from __future__ import annotations

import shlex
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import click

from nondum.cli import complete, render
from nondum.cli.connection import json_option
from nondum.cli.judge import FOLDER, KEY, inspect, loaded_payload, payloads, size_of
from nondum.cli.payload_data import data
from nondum.cli.payload_options import Destination, written
from nondum.cli.progress import ProgressLine
from nondum.cli.session import Session
from nondum.cli.verify import check, verify
from nondum.sdk.errors import NondumError

INSTALL_TIMEOUT_S = 600.0


@click.group()
def payload() -> None:
    """Make, judge and install payloads.

    Example: nondum payload new window-opener
    """


@payload.command()
@click.argument("name")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder to make [default: ./NAME].",
)
@click.option("--id", "payload_id", help="The payload's id [default: org.example.NAME].")
@json_option
@click.pass_obj
def new(session: Session, name: str, output: Path | None, payload_id: str | None) -> None:
    """Make a complete plugin package that passes its own tests.

    Example: nondum payload new window-opener && cd window-opener && pytest
    """
    from importlib_metadata import distributions

    from nondum.wheelhouse.build import scaffold

    made = scaffold.new_package(name, output or Path(name), payload_id=payload_id)
    if session.as_json:
        render.as_json({"folder": str(made.folder), "files": [str(path) for path in made.files]})
        return
    for path in made.files:
        click.echo(f"{made.folder / path}")
    sdk = next((found.origin for found in distributions(name="nondum-sdk")), None)
    build = scaffold.build_command(sdk)
    click.echo(f"next: cd {shlex.quote(str(made.folder))}; pytest; {build}")


@payload.command()
@click.argument("packages", metavar="PKG…", nargs=-1, required=True, type=FOLDER)
@written
@click.option("--arch", "architectures", multiple=True, help="x86_64, aarch64 [default: this].")
@click.option("--python", "pythons", multiple=True, help="3.11 … [default: 3.11, 3.12, 3.13].")
@click.option(
    "--library",
    "libraries",
    multiple=True,
    type=FOLDER,
    help="Source folder of a distribution that it depends on and that no index has.",
)
@click.option("--wheels", "wheels", multiple=True, type=FOLDER, help="Folder of wheels to use.")
@click.option("--offline", is_flag=True, help="Use those folders only, no index.")
@click.option("--quiet", "-q", is_flag=True, help="No progress.")
@json_option
@click.pass_obj
def build(
    session: Session,
    packages: tuple[Path, ...],
    to: Destination,
    architectures: tuple[str, ...],
    pythons: tuple[str, ...],
    libraries: tuple[Path, ...],
    wheels: tuple[Path, ...],
    offline: bool,
    quiet: bool,
) -> None:
    """Build one payload a package, with wheels for every architecture and Python. A wheel that
    several of them take is carried once; of a large payload it is told what each of them costs.

    \b
    Examples: nondum payload build . -o /media/usb
              nondum payload build a b -o drive --arch x86_64 --arch aarch64 --python 3.11
    """
    from nondum.cli import costs
    from nondum.host.trust import vocabulary_check
    from nondum.wheelhouse.build import build as building
    from nondum.wheelhouse.build import cost
    from nondum.wheelhouse.build.resolve import Sources
    from nondum.wheelhouse.format.target import PYTHONS, Target, targets

    options = building.Options(
        targets=targets(architectures or (Target.here().architecture,), pythons or PYTHONS),
        sources=Sources(wheels, offline),
        libraries=libraries,
        release=to.release,
        fleet=to.fleet,
        hosts=to.hosts,
        judge=lambda index: vocabulary_check.judge(index).problems,
        finish=to.sign,
    )
    made, before = [], _versions(to.output)
    for package in packages:
        is_wanted = not (quiet or session.as_json)
        with ProgressLine(package.resolve().name, is_wanted=is_wanted) as show:
            made.append(building.build(package, to.output, options, show))
    found = {folder: cost.costs(loaded_payload(folder), options.targets) for folder in made}
    if session.as_json:
        rows = {str(folder): list(map(costs.row, told)) for folder, told in found.items()}
        render.as_json({"payloads": [str(folder) for folder in made], "targets": rows})
    elif not quiet:
        for folder in made:
            click.echo(f"{folder}  {size_of(folder)}")
            _remark_lower_version(folder, before.get(folder.name))
            if told := costs.remark(loaded_payload(folder).contents, found[folder]):
                render.sentence(told, colour="yellow", mark="warning: ")


@payload.command()
@click.argument("words", metavar="WORDS…", nargs=-1, required=True)
@written
@click.option("--id", "payload_id", default="org.example.goal", help="The payload's id.")
@json_option
@click.pass_obj
def goal(
    session: Session,
    words: tuple[str, ...],
    to: Destination,
    payload_id: str,
) -> None:
    """Put goals on a drive, in words: a robot wants them while it is plugged in.

    Each of WORDS is one goal. Robots take them only from those whose role may give `goals`:
    `nondum keys allow … --permission goals`.

    \b
    Examples: nondum payload goal "follow me" -o /media/usb --sign alice
              nondum payload goal "search for people" "come back" -o drive --id com.acme.search
    """
    from nondum.wheelhouse.build import goal_payload

    made = goal_payload.write(
        to.output, payload_id, words, release=to.release, fleet=to.fleet, hosts=to.hosts
    )
    to.sign(made)
    if session.as_json:
        render.as_json({"payloads": [str(made)]})
    else:
        click.echo(str(made))


@payload.command()
@click.argument("drive", type=FOLDER)
@click.option(
    "--key",
    "keys",
    multiple=True,
    required=True,
    type=KEY,
    help="An Ed25519 key of ssh-keygen: its file, or its .pub for the agent's.",
)
@json_option
@click.pass_obj
def sign(session: Session, drive: Path, keys: tuple[Path, ...]) -> None:
    """Sign a drive's payloads, or a payload folder; signatures of other keys stay.

    
    Examples: nondum payload sign /media/usb --key alice
              nondum payload sign drive --key a.pub --key b.pub
    """
    from nondum.wheelhouse.trust import owners_folder

    rows = []
    for folder in payloads(drive):
        for key in keys:
            signers = owners_folder.sign_payload(folder, key)
        rows.append({"payload": folder.name, "signers": list(signers)})
    if session.as_json:
        render.as_json({"signed": rows})
        return
    for row in rows:
        click.echo(f"signed {row['payload']}: {', '.join(row['signers'])}")


@payload.command()
@click.argument("drive", type=FOLDER)
@json_option
@click.pass_obj
def install(session: Session, drive: Path) -> None:
    """Install a drive's payloads for good, as initial components of the running host.

    Interrupted before it is done, it leaves nothing.

    Example: nondum payload install /media/usb
    """
    done = []
    for folder in payloads(drive):
        with ProgressLine(folder.name, is_wanted=not session.as_json) as show:
            done.append(_installed(session, folder.resolve(), show))
        if not session.as_json:
            click.echo(f"installed {done[-1]['payload']} {done[-1]['version']}")
    if session.as_json:
        render.as_json({"installed": done})


@payload.command()
@click.argument("payload_id", metavar="PAYLOAD", shell_complete=complete.upgraded)
@json_option
@click.pass_obj
def rollback(session: Session, payload_id: str) -> None:
    """Go back to the release of a payload before the active one.

    The earlier one must be plugged in, or installed, too; one that is refused only for being older
    is let pass this once. The newer one waits; `nondum retry PAYLOAD` goes forward again.

    Example: nondum payload rollback org.example.window-opener
    """
    with ProgressLine(payload_id, is_wanted=not session.as_json) as show:
        row = _followed(session, show, "rollback", payload=payload_id)
    if session.as_json:
        render.as_json(row)
    else:
        click.echo(f"{row['payload']} {row['version']} is active, release {render.release(row)}")


def _installed(session: Session, folder: Path, show: ProgressLine) -> Any:
    """Install a payload, and give its row."""
    return _followed(session, show, "install", folder=str(folder))


def _followed(session: Session, show: ProgressLine, verb: str, **arguments: str) -> Any:
    """Have something done for a payload, show how far it is, and give its row at last."""
    row: Any = None
    with closing(session.follow(verb, **arguments)) as news:
        for told in news:
            row = told["payload"]
            if told["done"]:
                break
            if row is not None:
                made = row["progress"] or {"phase": row["state"], "done": 0, "total": 0}
                show(made["phase"], made["done"], made["total"])
    return row


@payload.command()
@click.argument("payload_id", metavar="PAYLOAD", shell_complete=complete.installed)
@json_option
@click.pass_obj
def uninstall(session: Session, payload_id: str) -> None:
    """Remove an installed payload from the running host.

    Example: nondum payload uninstall org.example.window-opener
    """
    done = session.ask("uninstall", timeout_s=INSTALL_TIMEOUT_S, payload=payload_id)
    if session.as_json:
        render.as_json(done)
    else:
        click.echo(f"uninstalled {payload_id}")


@payload.command()
@click.argument("payload_id", metavar="PAYLOAD", shell_complete=complete.former)
@json_option
@click.pass_obj
def forget(session: Session, payload_id: str) -> None:
    """Forget a payload that was here and is gone.

    The host remembers what such payloads could do, to say which would help; see `nondum advise`.

    Example: nondum payload forget org.example.window-opener
    """
    done = session.ask("forget", payload=payload_id)
    if session.as_json:
        render.as_json(done)
    else:
        click.echo(f"forgot {payload_id}")


def _versions(drive: Path) -> dict[str, str]:
    """Payload id → version, of what a drive carries already."""
    from nondum.wheelhouse.payload.drive import find_payloads

    found = {}
    for folder in find_payloads(drive) if drive.is_dir() else ():
        with suppress(NondumError):  # it is to be replaced
            found[folder.name] = loaded_payload(folder).contents.version
    return found


def _remark_lower_version(folder: Path, before: str | None) -> None:
    """Say that a version went down while the release went up: hosts go by the release."""
    from packaging.version import Version

    now = loaded_payload(folder).contents.version
    if before is not None and Version(now) < Version(before):
        told = (
            f"this is version {now}, {before} was here; hosts take the newer release all the same"
        )
        render.sentence(told, colour="yellow", mark="warning: ")


payload.add_command(data)
payload.add_command(inspect)
payload.add_command(check)
payload.add_command(verify)
