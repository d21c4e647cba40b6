"""NMEA 0183: bytes of a serial line in, the sentences that tell of a fix out.

A sentence is `$`, a talker of two letters (GP, GL, GA, GB, GN: which satellites), a formatter of
three, fields between commas, `*` and the XOR of all bytes between `$` and `*` in hexadecimal.
pynmeagps knows the fields of each. What has no sum, or a wrong one, is dropped, as is all between
sentences: receivers of u-blox send binary messages (UBX) on the same line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from pynmeagps import NMEAReader
from pynmeagps.exceptions import NMEAMessageError, NMEAParseError, NMEATypeError

_LONGEST = 256
"""Bytes of a sentence. The standard has 82; receivers of high precision exceed that."""
_FORM = re.compile(rb"\$[A-Z]{2}(?:GGA|RMC|GSA|GST|GSV),[\x20-\x29\x2b-\x7e]*\*[0-9A-Fa-f]{2}")


@dataclass(frozen=True, slots=True)
class Place:
    """In WGS 84, north and east positive."""

    latitude_deg: float
    longitude_deg: float


@dataclass(frozen=True, slots=True)
class Gga:
    """A fix: where, how good, by how many satellites."""

    place: Place | None
    quality: int
    """0: none; 1: satellites; 2: corrected; 4, 5: by a base station; all others: guessed."""
    satellites: int | None
    hdop: float | None
    sea_level_m: float | None
    """Above mean sea level."""
    geoid_m: float | None
    """Mean sea level above the ellipsoid."""


@dataclass(frozen=True, slots=True)
class Rmc:
    """The least that is recommended to be sent."""

    place: Place | None
    is_valid: bool
    mode: str
    """A, D, E, M, N, S, and since NMEA 2.3 and 4.1 F, P, R; empty before."""


@dataclass(frozen=True, slots=True)
class Gsa:
    """What the geometry of the satellites does to the fix."""

    is_flat: bool
    """The height is assumed, not measured."""
    vdop: float | None


@dataclass(frozen=True, slots=True)
class Gst:
    """Standard errors of the fix, in metres."""

    north_m: float
    east_m: float
    up_m: float


@dataclass(frozen=True, slots=True)
class Gsv:
    """How many satellites of one kind are above the horizon."""

    talker: str
    in_view: int


Sentence: TypeAlias = Gga | Rmc | Gsa | Gst | Gsv


class Decoder:
    """Finds the sentences in bytes that come in pieces."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[Sentence]:
        """The sentences that these bytes complete."""
        *lines, rest = (self._rest + data).split(b"\n")
        self._rest = rest[-_LONGEST:]
        return [sentence for line in lines for sentence in _sentences(line)]


def _sentences(line: bytes) -> Iterator[Sentence]:
    """The one sentence of a line, after whatever precedes it; none where it is damaged."""
    text = line[max(line.rfind(b"$"), 0) :].removesuffix(b"\r")
    if len(text) > _LONGEST - len(b"\r") or not _FORM.fullmatch(text):
        return
    try:
        fields: Any = NMEAReader.parse(text)
    except (NMEAMessageError, NMEAParseError, NMEATypeError):
        return
    sentence = _TAKEN[fields.msgID](fields)
    if sentence is not None:
        yield sentence


def _gga(fields: Any) -> Gga:
    return Gga(
        _place(fields),
        quality=_whole(fields, "quality") or 0,
        satellites=_whole(fields, "numSV"),
        hdop=_number(fields, "HDOP"),
        sea_level_m=_number(fields, "alt"),
        geoid_m=_number(fields, "sep"),
    )


def _rmc(fields: Any) -> Rmc:
    return Rmc(
        _place(fields),
        is_valid=getattr(fields, "status", "") == "A",
        mode=getattr(fields, "posMode", ""),
    )


def _gsa(fields: Any) -> Gsa:
    return Gsa(is_flat=_whole(fields, "navMode") != 3, vdop=_number(fields, "VDOP"))


def _gst(fields: Any) -> Gst | None:
    errors = [_number(fields, name) for name in ("stdLat", "stdLong", "stdAlt")]
    known = [error for error in errors if error is not None and error >= 0]
    return Gst(*known) if len(known) == len(errors) else None


def _gsv(fields: Any) -> Gsv | None:
    in_view = _whole(fields, "numSV")
    return None if in_view is None else Gsv(fields.talker, in_view)


_TAKEN: Mapping[str, Callable[[Any], Sentence | None]] = {
    "GGA": _gga,
    "RMC": _rmc,
    "GSA": _gsa,
    "GST": _gst,
    "GSV": _gsv,
}


def _place(fields: Any) -> Place | None:
    """None where a part is missing, or that is not on Earth."""
    latitude, longitude = _number(fields, "lat"), _number(fields, "lon")
    if latitude is None or longitude is None:
        return None
    if fields.NS not in ("N", "S") or getattr(fields, "EW", "") not in ("E", "W"):
        return None
    is_on_earth = abs(latitude) <= 90 and abs(longitude) <= 180
    return Place(latitude, longitude) if is_on_earth else None


def _number(fields: Any, name: str) -> float | None:
    value = getattr(fields, name, "")
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def _whole(fields: Any, name: str) -> int | None:
    value = getattr(fields, name, "")
    return value if isinstance(value, int) and value >= 0 else None
