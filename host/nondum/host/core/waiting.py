"""What is said of a component that is well and waits for a device, or for data."""

from __future__ import annotations

from collections.abc import Sequence

from nondum.host.core.records.component import ComponentRecord, ComponentState


def waits(component: ComponentRecord) -> str:
    """`waits for its device head`, `waits for its data weights`; empty where it waits for nothing,
    or has other troubles."""
    if component.state is not ComponentState.READY or component.is_ready:
        return ""
    devices = _called("device", "devices", component.missing_devices)
    data = _called("data", "data", component.missing_data)
    return f"waits for its {' and its '.join((*devices, *data))}"


def waits_to_act(component: ComponentRecord) -> str:
    """`turret waits for its device head (then it can point)`; empty as that of `waits`."""
    told, names = waits(component), ", ".join(component.abilities)
    then = f" (then it can {names})" if names else ""
    return told and f"{component.id} {told}{then}"


def _called(one: str, several: str, names: Sequence[str]) -> tuple[str, ...]:
    kind = several if len(names) > 1 else one
    return (f"{kind} {' and '.join(names)}",) if names else ()
