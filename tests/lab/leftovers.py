"""What of a payload could be left over in a machine, when its drive has been pulled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tests.lab.followed import EVERY_S, Followed
from tests.lab.installed import PATIENCE_S

LOOK = """
cd /var/lib/nondum
grep -E ' (/run/nondum-helper/mounts|/var/lib/nondum/mounts)/' /proc/mounts
ls -d /run/nondum-helper/mounts/* staging/* payloads/* venvs/* scratch/* mounts/* 2>/dev/null
for process in $(grep -zls ^NONDUM_WORKER= /proc/[0-9]*/environ); do echo worker; done
true
"""
"""Mounts, folders and processes that payloads have, the same as in `tests.kit.traces`."""


@dataclass(frozen=True)
class Seen:
    """What there is now."""

    daemon: str
    """Its process."""
    traces: str
    """Mounts, folders, workers."""
    payloads: tuple[str, ...]
    components: tuple[str, ...]
    drives: tuple[str, ...]


def seen(host: Followed) -> Seen | None:
    """What there is now; None while the daemon does not answer."""
    view = host.status()
    if view is None:
        return None
    return Seen(
        daemon=host.shown("MainPID"),
        traces=host.machine.run(LOOK),
        payloads=_names(view["payloads"], "payload"),
        components=_names(view["components"], "component"),
        drives=_names(view["drives"], "drive"),
    )


def until_as_before(host: Followed, before: Seen) -> None:
    """Wait until there is nothing else than before. Raises `AssertionError` with what is left."""
    last: list[Seen | None] = [None]

    def look() -> bool | None:
        last[0] = seen(host)
        return True if last[0] == before else None

    try:
        host.machine.until("all as before", look, PATIENCE_S, EVERY_S)
    except AssertionError as error:
        raise AssertionError(f"{error}\nbefore: {before}\nnow:    {last[0]}") from None


def _names(rows: list[dict[str, Any]], key: str) -> tuple[str, ...]:
    return tuple(sorted(str(row[key]) for row in rows))
