"""Which device serves which declared need of which component.

The rule: a need is given all nodes of a device that match it, or none. A device stays with the
component that has it; a free one goes to the first that needs it, by name, and of several
that serve a need the first by port is given. Several components may have parts of one device, as
long as no node is wanted twice. The host tells people which other components want a device. It does
not touch a device that no component needs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from nondum.host.core.effects import AttachDevice, DetachDevice
from nondum.host.core.events.devices import DeviceClaimed, DeviceReleased
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.device import DeviceClaim, DeviceNode, DeviceRecord
from nondum.host.lifecycle.retrying import try_again
from nondum.host.lifecycle.turn import Turn
from nondum.host.sources.devices.matching import chosen, serving

_Need = tuple[str, str]
"""Component, and the name of its need."""


def assign(
    components: Mapping[str, ComponentRecord], devices: Mapping[str, DeviceRecord]
) -> dict[str, tuple[DeviceClaim, ...]]:
    """The claims of every component, as they should be now."""
    held = _kept(components, devices)
    owners = {path: need for need, (_, nodes) in held.items() for path in nodes}
    for component, claim in _needs(components):
        need = component, claim.name
        for device in _candidates(held.get(need), devices):
            wanted = _paths(serving(devices[device], claim.match))
            if wanted and all(owners.get(path, need) == need for path in wanted):
                held[need] = device, wanted
                owners.update(dict.fromkeys(wanted, need))
                break
    return {
        component.id: tuple(
            _claim(component.id, claim, held, components, devices) for claim in component.devices
        )
        for component in components.values()
    }


def serves(device: DeviceRecord, claim: DeviceClaim) -> bool:
    """Whether a need could have something of a device."""
    return bool(serving(device, claim.match))


def granted(device: DeviceRecord, claim: DeviceClaim) -> tuple[DeviceNode, ...]:
    """The nodes that a claim has of its device."""
    return chosen(device, claim.nodes)


def handed_over(
    new: Sequence[ComponentRecord],
    old: Mapping[str, ComponentRecord],
    devices: Mapping[str, DeviceRecord],
) -> tuple[ComponentRecord, ...]:
    """Components of a release that takes over, with the devices that those of `old` have.

    A device goes to the same need of the same component if it still serves it; what is left, as
    after a change of names, to the first other need that it serves.
    """
    free = {(o.id, c.name): c for o in old.values() for c in o.devices if c.device}
    given: dict[_Need, DeviceClaim] = {}
    for is_same in (True, False):
        for component in new:
            for claim in component.devices:
                need = component.id, claim.name
                fitting = (
                    owner
                    for owner, had in sorted(free.items())
                    if (owner == need or not is_same)
                    and had.device is not None
                    and _shared(devices[had.device], claim, had)
                )
                if need not in given and (owner := next(fitting, None)) is not None:
                    given[need] = free.pop(owner)
    return tuple(
        replace(
            component,
            devices=tuple(
                _taken_over(claim, given.get((component.id, claim.name)), devices)
                for claim in component.devices
            ),
        )
        for component in new
    )


def settle(turn: Turn, before: Mapping[str, DeviceRecord]) -> None:
    """Bring claims up to date with the components and devices of a turn; `before` it, devices were
    these."""
    wanted = assign(turn.state.components, turn.state.devices)
    for id, claims in wanted.items():
        component = turn.state.components[id]
        for old, new in zip(component.devices, claims, strict=True):
            _move(turn, id, old, new, before)
        if claims != component.devices:
            turn.put_component(replace(component, devices=claims))
            if any(
                new.device and not old.device
                for old, new in zip(component.devices, claims, strict=True)
            ):
                try_again(turn, id, "has its device again")


def _move(
    turn: Turn,
    component: str,
    old: DeviceClaim,
    new: DeviceClaim,
    before: Mapping[str, DeviceRecord],
) -> None:
    nodes = granted(turn.state.devices[new.device], new) if new.device is not None else ()
    if old.device == new.device:
        had = before.get(old.device) if old.device is not None else None
        if nodes and (old.nodes != new.nodes or (had and granted(had, old) != nodes)):
            turn.effects.append(AttachDevice(component, new.name, nodes))
        return
    if old.device is not None:
        turn.effects.append(DetachDevice(component, new.name, old.device))
        turn.events.append(DeviceReleased(old.device, component, new.name))
    if new.device is not None:
        turn.effects.append(AttachDevice(component, new.name, nodes))
        turn.events.append(DeviceClaimed(new.device, component, new.name))


def _needs(components: Mapping[str, ComponentRecord]) -> Iterator[tuple[str, DeviceClaim]]:
    return ((id, claim) for id in sorted(components) for claim in components[id].devices)


def _kept(
    components: Mapping[str, ComponentRecord], devices: Mapping[str, DeviceRecord]
) -> dict[_Need, tuple[str, tuple[Path, ...]]]:
    """What every need still has of the device that it had."""
    held = {}
    for id, claim in _needs(components):
        device = devices.get(claim.device) if claim.device is not None else None
        if device is not None and (still := _shared(device, claim, claim)):
            held[id, claim.name] = device.id, still
    return held


def _shared(device: DeviceRecord, claim: DeviceClaim, had: DeviceClaim) -> tuple[Path, ...]:
    """The nodes that serve a need, of those that another one (or it) had."""
    return tuple(path for path in _paths(serving(device, claim.match)) if path in had.nodes)


def _taken_over(
    claim: DeviceClaim, had: DeviceClaim | None, devices: Mapping[str, DeviceRecord]
) -> DeviceClaim:
    if had is None or had.device is None:
        return replace(claim, device=None, nodes=())
    return replace(claim, device=had.device, nodes=_shared(devices[had.device], claim, had))


def _candidates(
    held: tuple[str, tuple[Path, ...]] | None, devices: Mapping[str, DeviceRecord]
) -> list[str]:
    """Where a need looks: at the device that it has, for more of it, or at all of them."""
    return [held[0]] if held is not None else sorted(devices)


def _paths(nodes: Sequence[DeviceNode]) -> tuple[Path, ...]:
    return tuple(node.node for node in nodes)


def _claim(
    component: str,
    claim: DeviceClaim,
    held: Mapping[_Need, tuple[str, tuple[Path, ...]]],
    components: Mapping[str, ComponentRecord],
    devices: Mapping[str, DeviceRecord],
) -> DeviceClaim:
    found = held.get((component, claim.name))
    if found is None:
        return replace(claim, device=None, nodes=(), contested_by=())
    device, nodes = found
    losers = {
        other
        for other, need in _needs(components)
        if other != component
        and (other, need.name) not in held
        and not set(nodes).isdisjoint(_paths(serving(devices[device], need.match)))
    }
    return replace(claim, device=device, nodes=nodes, contested_by=tuple(sorted(losers)))
