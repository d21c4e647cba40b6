"""This machine as payloads are judged for it, by commands that judge without the daemon."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nondum.cli.session import Session
from nondum.sdk.errors import HostUnreachable

if TYPE_CHECKING:
    from nondum.wheelhouse.format.confinement import Level
    from nondum.wheelhouse.payload.host_facts import HostFacts


def this_machine(session: Session) -> HostFacts:
    """What there is here, and the level at which the host that runs here confines workers.

    Where none runs, the best level that the one who asks could have. Blocks, to find that out.
    """
    from nondum.wheelhouse.payload import host_facts

    return host_facts.probe(Path.cwd(), reserve_mb=0, confinement=_level(session))


def _level(session: Session) -> Level:
    from nondum.host.workers import confinement_choice
    from nondum.wheelhouse.format import confinement

    try:
        view = session.ask("status")
    except HostUnreachable:
        return confinement_choice.best()
    return confinement.parse(view["confinement"]["level"])
