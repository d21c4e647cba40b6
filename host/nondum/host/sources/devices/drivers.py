"""Which known payloads would drive a device that nothing here drives. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol

from nondum.host.core.records.device import DeviceRecord
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.mind.diagnosis import moment
from nondum.host.sources.devices.matching import left_alone, serving
from nondum.sdk.description import PluginDescription
from nondum.sdk.frozen import frozen
from nondum.wheelhouse.format.device_rules import names_id


class Payload(Protocol):
    """A payload that is known of and not at work here."""

    @property
    def id(self) -> str:
        """The payload's id."""
        ...

    @property
    def version(self) -> str:
        """Which of its releases."""
        ...

    @property
    def where(self) -> str:
        """Where it is, for people."""
        ...

    @property
    def components(self) -> Mapping[str, PluginDescription]:
        """What it brings."""
        ...


@frozen
class Remembered:
    """A payload that was here."""

    id: str
    version: str
    where: str
    components: Mapping[str, PluginDescription]


@frozen
class Driver:
    """What of a payload would use a device."""

    payload: str
    version: str
    where: str
    component: str
    need: str

    def __str__(self) -> str:
        return f"{self.payload} {self.version} ({self.where})"


def drivers_of(device: DeviceRecord, known: Iterable[Payload]) -> tuple[Driver, ...]:
    """The payloads with a need that a device serves: those that ask for it by what it is, or if
    there are none of these, by its kind."""
    if left_alone(device):
        return ()
    found = [
        (names_id(need.match), Driver(p.id, p.version, p.where, component, need.name))
        for p in known
        for component, description in p.components.items()
        for need in description.devices
        if serving(device, need.match)
    ]
    by_id = [driver for names, driver in found if names]
    return tuple(by_id or (driver for _, driver in found))


def remembered(snapshot: Snapshot) -> Iterator[Remembered]:
    """Payloads that were here, but for those that are here in another release or state."""
    here = {payload.payload_id for payload in snapshot.payloads}
    for former in snapshot.former:
        if former.payload_id not in here:
            where = f"here until {moment(former.left_wall_s)}"
            yield Remembered(former.payload_id, former.version, where, former.components)


def missed(lonely: Iterable[DeviceRecord], known: Iterable[Payload]) -> list[str]:
    """Sentences about devices that no component has; none about those that no payload drives."""
    payloads = tuple(known)
    told = []
    for device in lonely:
        drivers = dict.fromkeys(map(str, drivers_of(device, payloads)))
        if drivers:
            name = device.name or device.identity
            told.append(f"nothing here drives {name} ({device.id}): {' or '.join(drivers)} would")
    return told
