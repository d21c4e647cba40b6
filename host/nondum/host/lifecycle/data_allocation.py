"""Which data are shown to which component: several may read the same.

A component keeps what it is shown as long as that is here. Of several that would do it is shown the
highest version, of those the first by id.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from packaging.version import Version

from nondum.host.core.effects import HideData, ShowData
from nondum.host.core.events.data import DataShown, DataWithdrawn
from nondum.host.core.records.component import ComponentRecord
from nondum.host.core.records.data import DataClaim, DataRecord
from nondum.host.lifecycle.retrying import try_again
from nondum.host.lifecycle.turn import Turn


def settle(turn: Turn) -> None:
    """Bring what components are shown up to date with the data and components of a turn."""
    for component in tuple(turn.state.components.values()):
        claims = tuple(_settled(claim, turn.state.data) for claim in component.data)
        if claims != component.data:
            _change(turn, component, claims)


def _change(turn: Turn, component: ComponentRecord, claims: tuple[DataClaim, ...]) -> None:
    for old, new in zip(component.data, claims, strict=True):
        if old.data == new.data:
            continue
        name = new.need.name
        if old.data is not None:
            turn.events.append(DataWithdrawn(old.data, component.id, name))
        if new.data is not None:
            turn.events.append(DataShown(new.data, component.id, name))
            turn.effects.append(
                ShowData(component.id, component.payload, name, turn.state.data[new.data])
            )
        else:
            turn.effects.append(HideData(component.id, component.payload, name))
    turn.put_component(replace(component, data=claims))
    if any(new.data and not old.data for old, new in zip(component.data, claims, strict=True)):
        try_again(turn, component.id, "has its data again")


def _settled(claim: DataClaim, data: Mapping[str, DataRecord]) -> DataClaim:
    fitting = [d for d in data.values() if claim.need.is_met_by(d.kind, d.name, d.version)]
    if any(found.id == claim.data for found in fitting):
        return claim
    best = max(sorted(fitting, key=_id, reverse=True), key=_version, default=None)
    return replace(claim, data=best.id if best is not None else None)


def _id(data: DataRecord) -> str:
    return data.id


def _version(data: DataRecord) -> Version:
    return Version(data.version)
