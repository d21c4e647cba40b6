"""Which device serves which declared need of which component.

The rule: a device stays with the component that has it; a free one goes to the first component,
by id, that needs it. Who else wants it is told, and nothing that nobody needs is touched.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from nondum.host.catalogue.records import ComponentRecord, DeviceClaim, DeviceRecord
from nondum.host.effects import AttachDevice, DetachDevice
from nondum.host.events import DeviceClaimed, DeviceReleased
from nondum.host.lifecycle.turn import Turn


def assign(
    components: Mapping[str, ComponentRecord], devices: Mapping[str, DeviceRecord]
) -> dict[str, tuple[DeviceClaim, ...]]:
    """The claims of every component, as they should be now."""
    owners = _kept(components, devices)
    for component, claim in _needs(components):
        if (component, claim.name) in owners.values():
            continue
        free = (d for d in sorted(devices) if d not in owners and serves(devices[d], claim))
        if (device := next(free, None)) is not None:
            owners[device] = component, claim.name
    held = {owner: device for device, owner in owners.items()}
    return {
        component.id: tuple(
            _claim(component.id, claim, held, components, devices) for claim in component.devices
        )
        for component in components.values()
    }


def serves(device: DeviceRecord, claim: DeviceClaim) -> bool:
    """Whether every property that a need names is there and matches its pattern."""
    return all(
        fnmatchcase(device.properties.get(name, ""), pattern)
        for name, pattern in claim.match.items()
    )


def handed_over(
    new: Sequence[ComponentRecord],
    old: Mapping[str, ComponentRecord],
    devices: Mapping[str, DeviceRecord],
) -> tuple[ComponentRecord, ...]:
    """Components of a release that takes over, with the devices that those of `old` have.

    A device goes to the same need of the same component if it still serves it; what is left, as
    after a change of names, to the first other need that it serves.
    """
    free = {c.device: (o.id, c.name) for o in old.values() for c in o.devices if c.device}
    given: dict[tuple[str, str], str] = {}
    for is_same in (True, False):
        for component in new:
            for claim in component.devices:
                need = component.id, claim.name
                fitting = (
                    device
                    for device, owner in sorted(free.items())
                    if (owner == need or not is_same) and serves(devices[device], claim)
                )
                if need not in given and (device := next(fitting, None)) is not None:
                    given[need] = device
                    del free[device]
    return tuple(
        replace(
            component,
            devices=tuple(
                replace(claim, device=given.get((component.id, claim.name)))
                for claim in component.devices
            ),
        )
        for component in new
    )


def settle(turn: Turn) -> None:
    """Bring claims up to date with the components and devices of a turn."""
    wanted = assign(turn.state.components, turn.state.devices)
    for id, claims in wanted.items():
        component = turn.state.components[id]
        if claims == component.devices:
            continue
        for before, after in zip(component.devices, claims, strict=True):
            _move(turn, id, before.device, after)
        turn.put_component(replace(component, devices=claims))


def _move(turn: Turn, component: str, before: str | None, after: DeviceClaim) -> None:
    if before == after.device:
        return
    if before is not None:
        turn.effects.append(DetachDevice(component, after.name, before))
        turn.events.append(DeviceReleased(before, component, after.name))
    if after.device is not None:
        device = turn.state.devices[after.device]
        turn.effects.append(AttachDevice(component, after.name, device))
        turn.events.append(DeviceClaimed(after.device, component, after.name))


def _needs(components: Mapping[str, ComponentRecord]) -> list[tuple[str, DeviceClaim]]:
    return [(id, claim) for id in sorted(components) for claim in components[id].devices]


def _kept(
    components: Mapping[str, ComponentRecord], devices: Mapping[str, DeviceRecord]
) -> dict[str, tuple[str, str]]:
    return {
        claim.device: (id, claim.name)
        for id, claim in _needs(components)
        if claim.device is not None and claim.device in devices
    }


def _claim(
    component: str,
    claim: DeviceClaim,
    held: Mapping[tuple[str, str], str],
    components: Mapping[str, ComponentRecord],
    devices: Mapping[str, DeviceRecord],
) -> DeviceClaim:
    device = held.get((component, claim.name))
    if device is None:
        return replace(claim, device=None, contested_by=())
    served = {owner for owner in held if held[owner] != device}
    losers = {
        other
        for other, need in _needs(components)
        if other != component and (other, need.name) not in served and serves(devices[device], need)
    }
    return replace(claim, device=device, contested_by=tuple(sorted(losers)))
