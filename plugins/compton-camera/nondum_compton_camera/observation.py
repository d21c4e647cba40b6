"""One stretch of listening: records in, and a better bearing whenever enough more have come."""

from __future__ import annotations

from nondum_compton_camera.bearing import Estimate, locate
from nondum_compton_camera.kinematics import Instrument, cones
from nondum_compton_camera.listmode import Decoder, Event, Status

_FIRST_LOOK = 50
_GROWTH = 1.2
_ENOUGH_CONES = 60
"""Below this the standard error is itself too uncertain to be believed."""
_ENOUGH_GAIN = 25.0
"""Log-likelihood above background alone; chance reaches 12 in about one of ten thousand skies."""


class Observation:
    """Events of one instrument since the observation began."""

    def __init__(self, instrument: Instrument) -> None:
        self._instrument = instrument
        self._decoder = Decoder()
        self._events: list[Event] = []
        self._next_look = _FIRST_LOOK
        self.status: Status | None = None
        """The instrument's latest word about itself."""
        self.estimate: Estimate | None = None
        """The latest look at the sky."""

    def add(self, data: bytes) -> None:
        """Take bytes off the line."""
        for record in self._decoder.feed(data):
            if isinstance(record, Event):
                self._events.append(record)
            else:
                self.status = record

    @property
    def events(self) -> int:
        return len(self._events)

    @property
    def discarded(self) -> int:
        """Bytes that belonged to no frame."""
        return self._decoder.discarded

    @property
    def is_due(self) -> bool:
        """Whether enough has come for another look; looks grow further apart, so that all of them
        together cost a few times the last one."""
        return len(self._events) >= self._next_look

    def look(self) -> None:
        """Reconstruct from all events so far: some hundredths of a second of arithmetic."""
        self._next_look = int(len(self._events) * _GROWTH)
        self.estimate = locate(cones(self._events, self._instrument))

    def is_good(self, accuracy_rad: float) -> bool:
        """Whether the latest look shows a source, and where it is well enough."""
        seen = self.estimate
        return (
            seen is not None
            and seen.events >= _ENOUGH_CONES
            and seen.gain >= _ENOUGH_GAIN
            and seen.sigma_rad <= accuracy_rad
        )
