"""What a receiver tells at one moment, put together of its sentences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, TypeVar

from nondum_gps.sentences import Gga, Gsa, Gst, Gsv, Place, Rmc, Sentence

Errors: TypeAlias = tuple[float, float, float]
"""Variances to the east, to the north and upwards, m²."""

_QUALITIES = {1: "fix", 2: "sbas", 3: "fix", 4: "gbas", 5: "gbas"}
"""GGA. Not among them: 0, no fix; 6, dead reckoning; 7, typed in; 8, simulated."""
_MODES = {"": "fix", "A": "fix", "D": "sbas", "P": "fix", "F": "gbas", "R": "gbas"}
"""RMC, with the same left out: N, E, M and S."""
_T = TypeVar("_T")
_FRESH_S = 3.0
"""What comes in sentences beside that of the fix is believed for that long."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One answer of the receiver to where it is."""

    status: str
    """Of a `GpsFix`; `none`: there is no fix, and the place is the last one that was known."""
    place: Place
    sea_level_m: float | None = None
    """Above mean sea level, as people and maps have it."""
    ellipsoid_m: float | None = None
    """Above the ellipsoid of WGS 84, as messages have it."""
    satellites: int | None = None
    """By which it was found."""
    variances_m2: Errors | None = None

    @property
    def is_fix(self) -> bool:
        return self.status != "none"

    def in_words(self) -> str:
        """For people.

        >>> Reading("fix", Place(51.05, 13.74), sea_level_m=118.2, satellites=8).in_words()
        '51.05000 N, 13.74000 E, 118 m, 8 satellites'
        >>> Reading("fix", Place(-33.85, -70.1)).in_words()
        '33.85000 S, 70.10000 W'
        """
        north, east = self.place.latitude_deg, self.place.longitude_deg
        words = [
            f"{abs(north):.5f} {'S' if north < 0 else 'N'}",
            f"{abs(east):.5f} {'W' if east < 0 else 'E'}",
        ]
        if self.sea_level_m is not None:
            words.append(f"{self.sea_level_m:.0f} m")
        if self.satellites is not None:
            words.append(f"{self.satellites} satellites")
        return ", ".join(words)


class Readings:
    """Makes readings of sentences: one of each GGA; of an RMC where a receiver sends no GGA."""

    def __init__(self, *, range_error_m: float) -> None:
        self._range_error_m = range_error_m
        self._place = Place(0.0, 0.0)
        self._sends_gga = True
        self._geometry: tuple[float, Gsa] | None = None
        self._errors: tuple[float, Gst] | None = None
        self._in_view: dict[str, tuple[float, int]] = {}

    def take(self, sentence: Sentence, now_s: float) -> Reading | None:
        """The reading that this sentence completes."""
        match sentence:
            case Gga():
                self._sends_gga = True
                return self._of_gga(sentence, now_s)
            case Rmc():
                sends_gga, self._sends_gga = self._sends_gga, False
                return None if sends_gga else self._of_rmc(sentence)
            case Gsa():
                self._geometry = (now_s, sentence)
            case Gst():
                self._errors = (now_s, sentence)
            case Gsv():
                self._in_view[sentence.talker] = (now_s, sentence.in_view)
        return None

    def in_view(self, now_s: float) -> int | None:
        """Satellites above the horizon; None where the receiver has not told of late."""
        fresh = [number for at_s, number in self._in_view.values() if now_s - at_s <= _FRESH_S]
        return sum(fresh) if fresh else None

    def _of_gga(self, gga: Gga, now_s: float) -> Reading:
        status = _QUALITIES.get(gga.quality, "none")
        if status == "none" or gga.place is None:
            return Reading("none", self._place, satellites=gga.satellites)
        self._place = gga.place
        geometry, errors = _fresh(self._geometry, now_s), _fresh(self._errors, now_s)
        is_flat = geometry is not None and geometry.is_flat
        sea_level = None if is_flat else gga.sea_level_m
        ellipsoid = None
        if sea_level is not None and gga.geoid_m is not None:
            ellipsoid = sea_level + gga.geoid_m
        return Reading(
            status,
            self._place,
            sea_level_m=sea_level,
            ellipsoid_m=ellipsoid,
            satellites=gga.satellites,
            variances_m2=self._variances(gga, geometry, errors),
        )

    def _of_rmc(self, rmc: Rmc) -> Reading:
        status = _MODES.get(rmc.mode, "none") if rmc.is_valid else "none"
        if status == "none" or rmc.place is None:
            return Reading("none", self._place)
        self._place = rmc.place
        return Reading(status, self._place)

    def _variances(self, gga: Gga, geometry: Gsa | None, errors: Gst | None) -> Errors | None:
        """The receiver's own; else by the dilution of precision, half of it in each direction."""
        if errors is not None:
            return errors.east_m**2, errors.north_m**2, errors.up_m**2
        if gga.hdop is None or geometry is None or geometry.is_flat or geometry.vdop is None:
            return None
        level = (gga.hdop * self._range_error_m) ** 2 / 2
        return level, level, (geometry.vdop * self._range_error_m) ** 2


def _fresh(told: tuple[float, _T] | None, now_s: float) -> _T | None:
    return told[1] if told is not None and now_s - told[0] <= _FRESH_S else None
