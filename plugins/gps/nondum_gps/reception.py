"""What one receiver has sent since it was plugged in: where it is, or why that is not known."""

from __future__ import annotations

from nondum.sdk.errors import Problem
from nondum_gps.reading import Reading, Readings
from nondum_gps.sentences import Decoder
from nondum_gps.settings import Settings


class Reception:
    """Bytes in, readings out. It has no clock: the caller says what time it is."""

    def __init__(self, settings: Settings, now_s: float) -> None:
        self._lost_after_s = settings.lost_after_s
        self._readings = Readings(range_error_m=settings.range_error_m)
        self._decoder = Decoder()
        self._bytes = 0
        self._began_s = now_s
        self._heard_s: float | None = None
        self._fix: Reading | None = None
        self._fixed_s = now_s

    def take(self, data: bytes, now_s: float) -> list[Reading]:
        """The readings that these bytes complete."""
        self._bytes += len(data)
        readings = []
        for sentence in self._decoder.feed(data):
            self._heard_s = now_s
            reading = self._readings.take(sentence, now_s)
            if reading is not None:
                readings.append(reading)
                if reading.is_fix:
                    self._fix, self._fixed_s = reading, now_s
        return readings

    def is_lost(self, now_s: float) -> bool:
        """Whether there has been no fix for too long, since the last one or since the beginning."""
        return now_s - self._fixed_s > self._lost_after_s

    def fix(self, now_s: float) -> Reading | None:
        """The latest fix, unless it is too old to be believed."""
        return None if self.is_lost(now_s) else self._fix

    def problem(self, now_s: float) -> Problem:
        """Why there is no fix, for people: GPS_SILENT or GPS_NO_FIX."""
        if self._heard_s is None:
            fix = "set `baud` to what the receiver sends with, and have it send GGA or RMC"
            since = f"in {now_s - self._began_s:.0f} s"
            if self._bytes:
                words = f"{self._bytes} bytes came {since}, and no NMEA sentence among them"
                return _problem("GPS_SILENT", words, fix)
            return _problem("GPS_SILENT", f"nothing came {since}", f"check the cable; {fix}")
        if now_s - self._heard_s > self._lost_after_s:
            words = f"no NMEA sentence came for {now_s - self._heard_s:.0f} s"
            return _problem("GPS_SILENT", words, "check the cable")
        never = "yet" if self._fix is None else f"for {now_s - self._fixed_s:.0f} s"
        in_view = self._readings.in_view(now_s)
        seen = "" if in_view is None else f"; {in_view} satellites are in view"
        return _problem(
            "GPS_NO_FIX",
            f"the receiver has had no fix {never}{seen}",
            "bring the antenna to where it sees the sky; the first fix takes a minute or two",
        )


def _problem(code: str, message: str, fix: str) -> Problem:
    return Problem(code, message, where="gps", fix=fix)
