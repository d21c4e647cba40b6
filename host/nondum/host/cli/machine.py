"""This machine as payloads are judged for it, by commands that judge without the daemon."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nondum.host.cli.connection import Session
from nondum.sdk.errors import HostUnreachable

if TYPE_CHECKING:
    from nondum.wheelhouse.confinement import Level
    from nondum.wheelhouse.preflight import HostFacts


def this_machine(session: Session) -> HostFacts:
    """What there is here, and the level at which the host that runs here confines workers.

    Where none runs, the best level that the one who asks could have. Blocks, to find that out.
    """
    from nondum.wheelhouse import preflight

    return preflight.probe(Path.cwd(), reserve_mb=0, confinement=_level(session))


def _level(session: Session) -> Level:
    from nondum.host.confinement import choice
    from nondum.wheelhouse import confinement

    try:
        view = session.ask("status")
    except HostUnreachable:
        return choice.best()
    return confinement.parse(view["confinement"]["level"])
