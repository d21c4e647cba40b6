"""Which confinement the workers of this host get: the best there is, or what was asked for."""

from __future__ import annotations

from pathlib import Path

from nondum.host.confinement import bubblewrap, level, probe
from nondum.host.confinement.level import Level, Standing
from nondum.host.confinement.systemd_service import Served
from nondum.host.workers.confinements import Boxed, Confinement, Held, Unconfined
from nondum.sdk.errors import ConfigRefused

AUTO = "auto"
CHOICES = (AUTO, *(str(int(each)) for each in reversed(Level)))


def standing(wanted: str, minimum: int, kept_in: Path | None = None) -> Standing:
    """The level to run at: the best one, or the one that is `wanted`. Blocks, see `probe.findings`.

    Raises `ConfigRefused` (CONFINEMENT_UNAVAILABLE) where that is not to be had, or below the
    minimum.
    """
    asked = None if wanted == AUTO else Level(int(wanted))
    least = Level(minimum) if asked is None else asked
    found = probe.findings(kept_in) if asked is None else probe.all_findings()
    if problems := tuple(level.refusals(found, asked, least)):
        raise ConfigRefused(*problems)
    return level.chosen(found, asked)


def confinement(at: Level, places: tuple[Path, ...]) -> Confinement:
    """What holds workers at a level that was found; their code and scratch are in `places`."""
    match at:
        case Level.BOX:
            bwrap = bubblewrap.program()
            assert bwrap is not None, "it has just been tried"
            for place in places:  # what is not there cannot be shown to a spare
                place.mkdir(parents=True, exist_ok=True)
            return Boxed(bwrap, places)
        case Level.SERVICE:
            return Served()
        case Level.KERNEL:
            return Held()
        case _:
            return Unconfined()


def best() -> int:
    """The best level that the one who asks could have here. Blocks, see `probe.findings`."""
    return int(standing(AUTO, 0).level)
