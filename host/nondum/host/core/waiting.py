"""What is said of a component that is well and waits for a device."""

from __future__ import annotations

from nondum.host.core.records.component import ComponentRecord, ComponentState


def waits(component: ComponentRecord) -> str:
    """`waits for its device head`; empty where it waits for none, or has other troubles."""
    missing = component.missing_devices
    if component.state is not ComponentState.READY or not missing:
        return ""
    return f"waits for its device{'s' if len(missing) > 1 else ''} {' and '.join(missing)}"


def waits_to_act(component: ComponentRecord) -> str:
    """`turret waits for its device head (then it can point)`; empty as that of `waits`."""
    told, names = waits(component), ", ".join(component.abilities)
    then = f" (then it can {names})" if names else ""
    return told and f"{component.id} {told}{then}"
