"""The follower: sightings and headings in, commands out; it reads no clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from nondum_visual_tracker.controller import Command, Gains, steer, without_target
from nondum_visual_tracker.crowd import Crowd
from nondum_visual_tracker.heading import Heading
from nondum_visual_tracker.sighting import Sighting
from nondum_visual_tracker.track import Track


class Follower:
    """Keeps one person ahead of the body.

    Stamps are on one clock. Bearings of sightings are relative to the body as it stood at their
    stamp; they are kept relative to a fixed direction, so that the body's own turning does not
    look like the person's walking.
    """

    def __init__(self, gains: Gains) -> None:
        self.heading = Heading()
        self._gains = gains
        self._crowd = Crowd(memory_s=gains.coast_s)
        self._last: Track | None = None

    def saw(self, sightings: Sequence[Sighting], stamp_s: float) -> None:
        """People were seen in an image taken at `stamp_s`, azimuths relative to the body.

        Who is followed is picked here: the person nearest straight ahead, or, for a while after
        somebody was lost, nearest to where they should be by now.
        """
        heading = self.heading.at(stamp_s)
        fixed = [replace(sight, azimuth=sight.azimuth + heading) for sight in sightings]
        crowd = self._crowd.seen(fixed, stamp_s)
        self._crowd = crowd.picked(self._expected(stamp_s, heading))
        self._last = self._crowd.target or self._last

    def command(self, now_s: float) -> Command:
        """What the body shall do now; call it at a steady rate."""
        heading = self.heading.at(now_s)
        target = self._crowd.target
        if target and now_s - target.seen_s > self._gains.coast_s:
            self._crowd = replace(self._crowd, target_number=None)
            target = None
        command = self._chosen(target, heading, now_s)
        self.heading.commanded(now_s, command.turn_rad_s)
        return command

    def unseen_s(self, now_s: float) -> float:
        """How long the person has been out of sight; 0 before anybody was picked."""
        return now_s - self._last.seen_s if self._last else 0.0

    def _chosen(self, target: Track | None, heading: float, now_s: float) -> Command:
        if target:
            return steer(target, heading, now_s, self._gains)
        if self._last is None:
            return Command()
        return without_target(self.unseen_s(now_s), self._last.rate, self._gains)

    def _expected(self, stamp_s: float, heading: float) -> float:
        if self._last and self.unseen_s(stamp_s) <= self._gains.stop_s:
            return self._last.at(stamp_s).azimuth
        return heading
