"""Which confinement the workers of this host get: the best there is, or what was asked for."""

from __future__ import annotations

from pathlib import Path

from nondum.host.config import confinement_level
from nondum.host.config.confinement_level import ConfinementState, Wanted
from nondum.host.sandbox.levels import bubblewrap
from nondum.host.workers import confinement_probe
from nondum.host.workers.boxed import Boxed
from nondum.host.workers.confinement import Confinement
from nondum.host.workers.held import Held
from nondum.host.workers.unconfined import Unconfined
from nondum.sdk.errors import ConfigRefused
from nondum.wheelhouse.format.confinement import Level


def confinement_state(
    wanted: Wanted, minimum: Level, kept_in: Path | None = None, place: Path | None = None
) -> ConfinementState:
    """The level to run at: the best one, or the one that is `wanted`. Blocks, see `probe.findings`.

    Raises `ConfigRefused` (CONFINEMENT_UNAVAILABLE) where that is not to be had, or below the
    minimum.
    """
    least = minimum if wanted == "auto" else wanted
    found = (
        confinement_probe.findings(kept_in, place)
        if wanted == "auto"
        else confinement_probe.all_findings(place)
    )
    if problems := tuple(confinement_level.refusals(found, wanted, least)):
        raise ConfigRefused(*problems)
    return confinement_level.chosen(found, wanted)


def confinement(found: ConfinementState, places: tuple[Path, ...]) -> Confinement:
    """What holds workers at a level that was found; their code and scratch are in `places`."""
    match found.level:
        case Level.SANDBOXED:
            bwrap = bubblewrap.program()
            assert bwrap is not None, "it has just been tried"
            for place in places:  # what is not there cannot be shown to a spare
                place.mkdir(parents=True, exist_ok=True)
            return Boxed(bwrap, places, has_users=found.has_users)
        case Level.RESTRICTED:
            return Held()
        case Level.NONE:
            return Unconfined()


def best() -> Level:
    """The best level that the one who asks could have here. Blocks, see `probe.findings`."""
    return confinement_state("auto", Level.NONE).level
