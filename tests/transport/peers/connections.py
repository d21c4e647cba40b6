"""The connections that a listener in this machine has accepted."""

from __future__ import annotations

from pathlib import Path

from tests.kit.until import until

_ESTABLISHED, _CLOSE_WAIT = "01", "08"


def until_none_is_left(port: int) -> None:
    """Wait until ZeroMQ's own thread has closed them all; nothing else runs meanwhile.

    Two looks, since a socket that is sent over hears of it a few milliseconds later.
    """
    looks: list[bool] = []

    def are_closed() -> bool:
        looks.append(not _accepted(port))
        return looks[-2:] == [True, True]

    until(f"the connections to port {port} are closed", are_closed)


def _accepted(port: int) -> list[str]:
    """Their other ends: proc_net_tcp(5)."""
    rows = [row.split() for row in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return [
        there
        for _, here, there, state, *_ in rows
        if int(here.rpartition(":")[2], 16) == port and state in (_ESTABLISHED, _CLOSE_WAIT)
    ]
