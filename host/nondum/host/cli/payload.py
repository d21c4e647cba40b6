"""Commands that make, judge and install payloads. None but `install` needs a host."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from nondum.host.cli import render
from nondum.host.cli.connection import connect, json_option
from nondum.host.cli.failure import EXIT_PROBLEMS
from nondum.sdk.errors import PayloadRefused, Problem

INSTALL_TIMEOUT_S = 600.0
FOLDER = click.Path(path_type=Path, exists=True, file_okay=False)


@click.group()
def payload() -> None:
    """Make, judge and install payloads."""


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
def new(name: str, output: Path | None, payload_id: str | None, as_json: bool) -> None:
    """Make a complete plugin package that passes its own tests.

    Example: nondum payload new window-opener && cd window-opener && pytest
    """
    from nondum.wheelhouse import scaffold

    made = scaffold.new_package(name, output or Path(name), payload_id=payload_id)
    if as_json:
        render.as_json({"folder": str(made.folder), "files": [str(path) for path in made.files]})
        return
    for path in made.files:
        click.echo(f"{made.folder / path}")
    click.echo(f"next: cd {made.folder}; pytest; nondum payload build . -o DRIVE")


@payload.command()
@click.argument("packages", metavar="PKG…", nargs=-1, required=True, type=FOLDER)
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path, file_okay=False),
    help="The drive: any folder.",
)
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
@click.option("--release", type=int, help="Number that orders releases [default: the time].")
@click.option("--fleet", default="", help="Robots that it is meant for [default: any].")
@click.option("--quiet", "-q", is_flag=True, help="No progress.")
@json_option
def build(
    packages: tuple[Path, ...],
    output: Path,
    architectures: tuple[str, ...],
    pythons: tuple[str, ...],
    libraries: tuple[Path, ...],
    wheels: tuple[Path, ...],
    offline: bool,
    release: int | None,
    fleet: str,
    quiet: bool,
    as_json: bool,
) -> None:
    """Build one payload a package, with wheels for every architecture and Python.

    \b
    Examples: nondum payload build . -o /media/usb
              nondum payload build a b -o drive --arch x86_64 --arch aarch64 --python 3.11
    """
    from nondum.wheelhouse import build as building
    from nondum.wheelhouse.resolve import Sources
    from nondum.wheelhouse.target import PYTHONS, Target, targets

    options = building.Options(
        targets=targets(architectures or (Target.here().architecture,), pythons or PYTHONS),
        sources=Sources(wheels, offline),
        libraries=libraries,
        release=release,
        fleet=fleet,
    )
    made = []
    for package in packages:
        show = _Progress(package.resolve().name, is_shown=not (quiet or as_json))
        made.append(building.build(package, output, options, show))
        show.end()
    if as_json:
        render.as_json({"payloads": [str(folder) for folder in made]})
    elif not quiet:
        for folder in made:
            click.echo(f"{folder}  {_size(folder)}")


@payload.command()
@click.argument("drive", type=FOLDER)
@json_option
def inspect(drive: Path, as_json: bool) -> None:
    """Show what a drive or payload folder says it carries. Nothing is checked or run.

    Example: nondum payload inspect /media/usb
    """
    views = [_view(folder) for folder in _payloads(drive)]
    if as_json:
        render.as_json({"payloads": views})
        return
    for view in views:
        click.echo(f"{view['id']} {view['version']} (release {view['release']}): {view['summary']}")
        for component in view["components"]:
            click.echo(f"  component {component['id']}: {', '.join(component['behaviours'])}")
            for wheel in component["wheels"]:
                click.echo(f"    {wheel}")


@payload.command()
@click.argument("drive", type=FOLDER)
@click.option("--anywhere", is_flag=True, help="Do not ask whether it fits this machine.")
@json_option
def check(drive: Path, anywhere: bool, as_json: bool) -> int:
    """Judge a drive or payload folder by the rules that hosts go by. Exits with 3 on problems.

    Example: nondum payload check /media/usb --json
    """
    from nondum.host import vocabulary_check
    from nondum.wheelhouse import preflight
    from nondum.wheelhouse.payload import verify_folder
    from nondum.wheelhouse.signatures import UnsignedAllowed

    facts = None if anywhere else preflight.probe(Path.cwd(), reserve_mb=0, confinement=0)
    problems: list[Problem] = []
    warnings: list[Problem] = []
    for folder in _payloads(drive):
        problems.extend(verify_folder(folder, UnsignedAllowed(), facts))
        if not problems:
            judged = vocabulary_check.judge(_load_index(folder))
            problems.extend(judged.problems)
            warnings.extend(judged.warnings)
    if as_json:
        render.as_json(
            {
                "ok": not problems,
                "problems": [problem.to_dict() for problem in problems],
                "warnings": [warning.to_dict() for warning in warnings],
            }
        )
    else:
        for problem in problems:
            click.secho(str(problem), fg="red")
        for warning in warnings:
            click.secho(f"warning: {warning}", fg="yellow")
        click.echo("refused" if problems else "accepted")
    return EXIT_PROBLEMS if problems else 0


@payload.command()
@click.argument("drive", type=FOLDER)
@json_option
@click.pass_context
def install(ctx: click.Context, drive: Path, as_json: bool) -> None:
    """Install a drive's payloads for good, as initial components of the running host.

    Example: nondum payload install /media/usb
    """
    with connect(ctx.obj, timeout_s=INSTALL_TIMEOUT_S) as client:
        done = [client.ask("install", folder=str(f.resolve())) for f in _payloads(drive)]
    if as_json:
        render.as_json({"installed": done})
    else:
        for row in done:
            click.echo(f"installed {row['payload']} {row['version']}")


@payload.command()
@click.argument("payload_id")
@json_option
@click.pass_context
def uninstall(ctx: click.Context, payload_id: str, as_json: bool) -> None:
    """Remove an installed payload from the running host.

    Example: nondum payload uninstall org.example.window-opener
    """
    with connect(ctx.obj) as client:
        done = client.ask("uninstall", payload=payload_id)
    if as_json:
        render.as_json(done)
    else:
        click.echo(f"uninstalled {payload_id}")


class _Progress:
    """One line that is written over on a terminal; nothing elsewhere."""

    def __init__(self, name: str, *, is_shown: bool) -> None:
        self._name = name
        self._is_shown = is_shown and sys.stderr.isatty()

    def __call__(self, phase: str, done: int, total: int) -> None:
        if self._is_shown:
            click.echo(f"\r\x1b[K{self._name}: {phase} ({done}/{total})", nl=False, err=True)

    def end(self) -> None:
        """Clear the line."""
        if self._is_shown:
            click.echo("\r\x1b[K", nl=False, err=True)


def _payloads(drive: Path) -> Iterator[Path]:
    """The payload folders of a drive, or the folder itself when it is one."""
    from nondum.wheelhouse import contents
    from nondum.wheelhouse.drive import find_payloads

    if (drive / contents.NAME).is_file():
        yield drive
        return
    found = find_payloads(drive)
    if not found:
        text = "there is no payload here"
        fix = "a drive has folders nondum/<payload-id>/ with a file CONTENTS"
        raise PayloadRefused(Problem("DRIVE_NOT_PAYLOAD", text, where=str(drive), fix=fix))
    yield from found


def _view(folder: Path) -> dict[str, Any]:
    from nondum.wheelhouse import contents, drive, lock, manifest

    listed = contents.parse(drive.read_contents(folder), f"{folder.name}/{contents.NAME}")
    said = manifest.parse((folder / manifest.NAME).read_text(encoding="utf-8"), manifest.NAME)
    described = _load_index(folder)
    components = []
    for component in said.components:
        name = lock.file_name(component.id)
        locked = lock.parse((folder / name).read_text(encoding="utf-8"), name)
        behaviours = described[component.id].behaviours
        components.append(
            {
                "id": component.id,
                "distribution": component.distribution,
                "behaviours": [behaviour.name for behaviour in behaviours],
                "wheels": [wheel.filename for wheel in locked.wheels],
            }
        )
    return {
        "id": listed.payload_id,
        "version": listed.version,
        "release": listed.release,
        "fleet": listed.fleet,
        "built": listed.built,
        "summary": said.summary,
        "bytes": listed.total_bytes,
        "components": components,
    }


def _load_index(folder: Path) -> Any:
    from nondum.wheelhouse import index

    return index.parse((folder / index.NAME).read_bytes(), index.NAME)


def _size(folder: Path) -> str:
    total = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    return f"{total / 1e6:.1f} MB"
