"""`nondum lab`: a payload on a whole emulated computer, by the laboratory of nondum's sources."""

from __future__ import annotations

import os
from pathlib import Path

import click

from nondum.cli.judge import payloads
from nondum.sdk.errors import ConfigRefused, Problem

CHECKOUT = "NONDUM_LAB"
"""The variable that names nondum's sources."""
LABORATORY = Path("tests/lab")
ARCHITECTURES = ("x86_64", "aarch64")


@click.command()
@click.argument(
    "drive", type=click.Path(exists=True, file_okay=False, resolve_path=True, path_type=Path)
)
@click.option(
    "--arch", type=click.Choice(ARCHITECTURES), default="x86_64", help="The computer's processor."
)
@click.option("--keep", is_flag=True, help="Keep its console and journal, whatever came of it.")
def lab(drive: Path, *, arch: str, keep: bool) -> None:
    """Plug a payload into an emulated computer, and tell what became of it.

    DRIVE is a folder as `nondum payload build -o DRIVE` fills it, or a payload's in it. It is
    put on a stick, which is plugged in, shown and pulled. The laboratory is in nondum's
    sources: stand in a checkout, or name one by the variable NONDUM_LAB. It needs root, and
    minutes.

    \b
    Examples: nondum lab drive
              nondum lab drive --arch aarch64
    """
    list(payloads(drive))
    program = _laboratory() / "run"
    options = ("--arch", arch, *(("--keep",) if keep else ()))
    os.execv(program, [str(program), "lab", *options, "--payload", str(drive), "payload"])


def _laboratory() -> Path:
    """The checkout. Raises `ConfigRefused` (LAB_MISSING)."""
    named = os.environ.get(CHECKOUT)
    here = Path.cwd()
    places = [Path(named).resolve()] if named else [here, *here.parents]
    for place in places:
        if (place / LABORATORY).is_dir() and os.access(place / "run", os.X_OK):
            return place
    raise ConfigRefused(
        Problem(
            "LAB_MISSING",
            "the laboratory is not here",
            where=f"{CHECKOUT}={named}" if named else str(here),
            need=f"a folder with run and {LABORATORY}",
            fix=f"stand in a checkout of nondum's sources, or name one: {CHECKOUT}=FOLDER",
        )
    )
