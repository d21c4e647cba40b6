"""Which known payloads would drive a device that nothing here drives. Pure but for its sources."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from nondum.host.catalogue.records import DeviceRecord, FormerPayload, Snapshot
from nondum.host.devices.matching import left_alone, serving
from nondum.host.mind.diagnosis import moment
from nondum.host.shelf import Shelved, distinct
from nondum.wheelhouse.device_rules import names_id


@dataclass(frozen=True, slots=True)
class Driver:
    """A payload that is not at work here, and what of it would use a device."""

    payload: str
    version: str
    where: str
    """Where it is, or until when it was here, for people."""
    component: str
    need: str

    def __str__(self) -> str:
        return f"{self.payload} {self.version} ({self.where})"


def drivers_of(device: DeviceRecord, known: Iterable[Shelved]) -> tuple[Driver, ...]:
    """The payloads with a need that a device serves: those that ask for it by what it is, or if
    there are none of these, by its kind."""
    if left_alone(device):
        return ()
    found = [
        (names_id(need.match), Driver(p.id, p.version, p.where, component, need.name))
        for p in distinct(known)
        for component, description in p.components.items()
        for need in description.devices
        if serving(device, need.match)
    ]
    by_id = [driver for names, driver in found if names]
    return tuple(by_id or (driver for _, driver in found))


def remembered(snapshot: Snapshot) -> Iterator[Shelved]:
    """Payloads that were here, but for those that are on their way back."""
    here = {payload.payload_id for payload in snapshot.payloads}
    for former in snapshot.former:
        if former.payload_id not in here:
            yield shelved(former)


def shelved(former: FormerPayload) -> Shelved:
    """A payload that was here, as advice sees it."""
    where = f"here until {moment(former.left_wall_s)}"
    return Shelved(former.payload_id, former.version, where, former.components)
