"""What people's tools may tell a host about where its units are mounted."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nondum.host.catalogue.catalogue import Catalogue
from nondum.host.control.arguments import Arguments, Triple
from nondum.host.control.committed import until_committed
from nondum.host.control.news import News
from nondum.host.core.bus import Bus
from nondum.host.core.events.mounts import MountSet
from nondum.host.core.names import whole
from nondum.host.core.records.mount import MountPose
from nondum.host.core.row import Row
from nondum.host.core.unknown import unknown
from nondum.host.mind.frames import implausible
from nondum.host.mind.mind import Mind
from nondum.sdk.errors import ConfigRefused
from nondum.sdk.frozen import frozen

_ZEROS: Triple = (0.0, 0.0, 0.0)


@frozen
class MountOrders:
    """Each method is a verb."""

    catalogue: Catalogue
    mind: Mind
    news: News
    bus: Bus

    async def mount(self, arguments: Arguments) -> Row:
        """Tell where a unit is mounted; what is not said stays as it was.

        Raises `ConfigRefused` (UNIT_UNKNOWN).
        """
        unit = whole(arguments.text("unit"), self.mind.names)
        known = {row["unit"] for row in self.mind.views.units()}
        if unit not in known:
            raise ConfigRefused(unknown("unit", unit, known))
        before = self.catalogue.snapshot().mount(unit)
        pose = MountPose(
            unit,
            arguments.triple("xyz") or (before.xyz if before else _ZEROS),
            arguments.triple("rpy") or (before.rpy if before else _ZEROS),
            "person",
        )
        self.bus.emit(MountSet(pose.unit, pose.xyz, pose.rpy))
        await until_committed(
            self.catalogue, self.news, lambda snapshot: snapshot.mount(unit) == pose
        )
        row = {"unit": unit, "xyz": list(pose.xyz), "rpy": list(pose.rpy)}
        return {**row, "warnings": list(implausible(pose))}

    def answering(self) -> dict[str, Callable[[Arguments], Awaitable[Any]]]:
        """Verbs that answer once."""
        return {"mount": self.mount}
