"""All people in sight, and the one who is followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from nondum_visual_tracker.assignment import assigned
from nondum_visual_tracker.sighting import Sighting
from nondum_visual_tracker.track import Track

GATE = 9.0
"""Squared standard deviations beyond which a sighting is somebody else."""
CONFIRMED_HITS = 2
"""Sightings before somebody counts as a person rather than a flicker of the detector."""


@dataclass(frozen=True, slots=True)
class Crowd:
    """What is believed about everybody in sight. A value: `seen` gives the next one."""

    tracks: tuple[Track, ...] = ()
    target_number: int | None = None
    """The person followed; None until somebody is picked, and when they are forgotten."""
    memory_s: float = 1.5
    """How long somebody who is not seen is remembered."""
    counted: int = 0

    @property
    def target(self) -> Track | None:
        """The track of the person followed."""
        return next((t for t in self.tracks if t.number == self.target_number), None)

    def seen(self, sightings: Sequence[Sighting], stamp_s: float) -> Crowd:
        """The crowd after an image taken at `stamp_s`; images older than the last are ignored.

        Those seen in the image before choose first: the less is known of somebody, the more
        sightings would fit, and a ghost would take a living person's.
        """
        if any(track.stamp_s > stamp_s for track in self.tracks):
            return self
        fresh_s = max((track.seen_s for track in self.tracks), default=stamp_s)
        expected = [track.at(stamp_s) for track in self.tracks]
        steady, strangers = _matched([t for t in expected if t.seen_s == fresh_s], sightings)
        doubted, strangers = _matched([t for t in expected if t.seen_s < fresh_s], strangers)
        known = [*steady, *doubted]
        fresh = [Track.of(self.counted + i, s, stamp_s) for i, s in enumerate(strangers)]
        remembered = tuple(t for t in [*known, *fresh] if self._is_remembered(t, stamp_s))
        return replace(self, tracks=remembered, counted=self.counted + len(fresh)).checked()

    def picked(self, azimuth: float) -> Crowd:
        """Pick the person nearest `azimuth` if none is followed; flickers are no persons."""
        people = [track for track in self.tracks if track.hits >= CONFIRMED_HITS]
        if self.target_number is not None or not people:
            return self
        nearest = min(people, key=lambda track: abs(track.azimuth - azimuth))
        return replace(self, target_number=nearest.number)

    def checked(self) -> Crowd:
        """Forget the choice when its person is forgotten."""
        return self if self.target else replace(self, target_number=None)

    def _is_remembered(self, track: Track, stamp_s: float) -> bool:
        patience = self.memory_s if track.hits >= CONFIRMED_HITS else self.memory_s / 3
        return stamp_s - track.seen_s <= patience


def _matched(
    expected: Sequence[Track], sightings: Sequence[Sighting]
) -> tuple[list[Track], list[Sighting]]:
    """The tracks after their sightings, and the sightings that belong to no track."""
    pairs = assigned([[t.distance(sight) for sight in sightings] for t in expected], gate=GATE)
    known = [
        track.seen(sightings[pairs[i]]) if i in pairs else track for i, track in enumerate(expected)
    ]
    taken = set(pairs.values())
    return known, [sight for i, sight in enumerate(sightings) if i not in taken]
