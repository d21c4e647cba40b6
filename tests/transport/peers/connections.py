"""The connections that a listener in this machine has accepted."""

from __future__ import annotations

from pathlib import Path

from tests.kit.until import until

_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))
_ESTABLISHED, _CLOSE_WAIT = "01", "08"


class Accepted:
    """Those to one port; there is at least one."""

    def __init__(self, port: int) -> None:
        self._port = port
        assert self._other_ends(), f"no connection to port {port}"

    def until_closed(self) -> None:
        """Wait until ZeroMQ's own thread has closed them all; nothing else runs meanwhile.

        Two looks, since a socket that is sent over hears of it a few milliseconds later.
        """
        looks: list[bool] = []

        def are_closed() -> bool:
            looks.append(not self._other_ends())
            return looks[-2:] == [True, True]

        until(f"the connections to port {self._port} are closed", are_closed)

    def _other_ends(self) -> list[str]:
        """The other ends of the connections: proc_net_tcp(5)."""
        lines = (line for table in _TABLES for line in table.read_text().splitlines()[1:])
        return [
            there
            for _, here, there, state, *_ in map(str.split, lines)
            if int(here.rpartition(":")[2], 16) == self._port
            and state in (_ESTABLISHED, _CLOSE_WAIT)
        ]
