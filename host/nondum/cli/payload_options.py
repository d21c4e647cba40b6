"""Options of the commands that write a payload: where to, for which robots, with which keys."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import click

from nondum.cli.judge import KEY
from nondum.sdk.frozen import frozen

_OPTIONS = (
    click.option(
        "-o",
        "--output",
        required=True,
        type=click.Path(path_type=Path, file_okay=False),
        help="The drive: any folder.",
    ),
    click.option("--release", type=int, help="Number that orders releases [default: the time]."),
    click.option("--fleet", default="", help="Robots that it is meant for [default: any]."),
    click.option("--host", "hosts", multiple=True, help="The only hosts it is for [default: any]."),
    click.option("--sign", "keys", multiple=True, type=KEY, help="Key to sign it with."),
)


@frozen
class Destination:
    """Where a payload goes, and which robots it is for."""

    output: Path
    """The drive."""
    release: int | None
    fleet: str
    hosts: tuple[str, ...]
    keys: tuple[Path, ...]

    def sign(self, folder: Path) -> None:
        """Sign a payload's folder with all keys."""
        from nondum.wheelhouse.trust import owners_folder

        for key in self.keys:
            owners_folder.sign_payload(folder, key)


def written(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command these options; it gets them as one, `to`."""

    @functools.wraps(command)
    def with_destination(
        *arguments: object,
        output: Path,
        release: int | None,
        fleet: str,
        hosts: tuple[str, ...],
        keys: tuple[Path, ...],
        **others: object,
    ) -> None:
        to = Destination(output, release, fleet, hosts, keys)
        command(*arguments, to=to, **others)

    for option in reversed(_OPTIONS):
        with_destination = option(with_destination)
    return with_destination
