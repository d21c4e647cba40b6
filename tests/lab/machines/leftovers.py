"""What of a payload could be left over in a machine, when its drive has been pulled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tests.lab.machines.installed import LOOK_S, PATIENCE_S, Installed

LOOK = """
echo mounts $(grep -cE '/nondum-helper/mounts|/nondum/mounts' /proc/mounts)
echo staged $(ls /var/lib/nondum/staging 2>/dev/null | wc -l)
echo workers $(pgrep -cf 'nondum[.]?.*host[/.]inside')
echo folders $(ls /run/nondum-helper/mounts 2>/dev/null | wc -l)
"""


@dataclass(frozen=True)
class Seen:
    """What there is now."""

    daemon: str
    """Its process."""
    counts: str
    """Mounts, staged payloads, workers."""
    payloads: tuple[str, ...]
    components: tuple[str, ...]
    drives: tuple[str, ...]


def seen(host: Installed) -> Seen | None:
    """What there is now; None while nobody answers."""
    view = host.status()
    if view is None:
        return None
    counts = host.machine.attempt(LOOK).out
    return Seen(
        daemon=host.shown("MainPID"),
        counts=counts,
        payloads=_names(view["payloads"], "payload"),
        components=_names(view["components"], "component"),
        drives=_names(view["drives"], "drive"),
    )


def until_as_before(host: Installed, before: Seen) -> None:
    """Wait until there is nothing else than before. Raises `AssertionError` with what is left."""
    last: list[Seen | None] = [None]

    def look() -> bool | None:
        last[0] = seen(host)
        return True if last[0] == before else None

    try:
        host.machine.until("all as before", look, PATIENCE_S, LOOK_S)
    except AssertionError as error:
        raise AssertionError(f"{error}\nbefore: {before}\nnow:    {last[0]}") from None


def _names(rows: list[dict[str, Any]], key: str) -> tuple[str, ...]:
    return tuple(sorted(str(row[key]) for row in rows))
