"""What is plugged into a machine's USB controller while it runs: sticks, hubs, serial adapters.

Ports are named as in QEMU: "4" is one of the controller, "4.2" one of the hub that is in it.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.lab.qmp import Qmp, QmpError

BUS = "xhci.0"
PORTS = 8
"""Of the controller, and of each hub."""
CONTROLLER = ("-device", f"qemu-xhci,id=xhci,p2={PORTS},p3={PORTS}")
RECONNECT_S = 1
Until = Callable[[str, Callable[[], bool | None]], bool]
"""Looks until there is something to see; its first argument says what."""


@dataclass(frozen=True, slots=True)
class _Plugged:
    port: str | None
    behind: tuple[str, dict[str, str]] | None
    """What QEMU is told to remove, once the guest has let go of the device."""


class Usb:
    """One controller, over one boot."""

    def __init__(self, qmp: Qmp, until: Until) -> None:
        self._qmp, self._until = qmp, until
        self._numbers = itertools.count(1)
        self._plugged: dict[str, _Plugged] = {}

    def plug_stick(self, image: Path, port: str | None) -> str:
        """Plug a stick in. Its serial number is the image's own, wherever it is plugged in."""
        name = self._name("stick")
        file = {"driver": "file", "filename": str(image)}
        self._qmp.do("blockdev-add", driver="raw", node_name=name, file=file)
        behind = ("blockdev-del", {"node_name": name})
        serial = hashlib.sha256(str(image).encode()).hexdigest()[:12].upper()
        stick = {"drive": name, "removable": True, "serial": serial}
        return self._add(name, "usb-storage", port, behind, stick)

    def plug_line(self, path: Path | None, port: str | None, serial: str | None) -> str:
        """Plug a serial adapter in, whose other end is a unix socket at which somebody listens."""
        name = self._name("line")
        self._qmp.do("chardev-add", id=name, backend=_backend(path))
        behind = ("chardev-remove", {"id": name})
        adapter: dict[str, Any] = {"chardev": name, "always_plugged": True}
        if serial is not None:
            adapter["serial"] = serial
        return self._add(name, "usb-serial", port, behind, adapter)

    def plug_hub(self, port: str | None) -> str:
        """Plug a hub in; only one whose port is given can have things plugged into it."""
        return self._add(self._name("hub"), "usb-hub", port, None, {"ports": PORTS})

    def plug_device(self, driver: str, port: str | None) -> str:
        """Plug in another of QEMU's USB devices, by the name of its driver there."""
        return self._add(self._name("device"), driver, port, None, {})

    def pull(self, name: str) -> None:
        """Pull something out, with all that is plugged into it; what went with its hub is gone."""
        gone = self._gone_with(name)
        if name in self._plugged:
            self._qmp.do("device_del", id=name)
        for each in gone:
            behind = self._plugged.pop(each).behind
            if behind is not None:
                self._let_go(*behind)

    def pull_all(self) -> None:
        """Pull everything out."""
        for name in tuple(self._plugged):
            self.pull(name)

    def _name(self, kind: str) -> str:
        return f"{kind}{next(self._numbers)}"

    def _add(
        self,
        name: str,
        driver: str,
        port: str | None,
        behind: tuple[str, dict[str, str]] | None,
        options: dict[str, Any],
    ) -> str:
        port = port or self._free()
        place = {"port": port} if port is not None else {}
        self._qmp.do("device_add", driver=driver, id=name, bus=BUS, **place, **options)
        self._plugged[name] = _Plugged(port, behind)
        return name

    def _free(self) -> str | None:
        """The last free port of the controller (scenarios name the first ones); None: QEMU chooses.

        QEMU takes the port that has been free for longest, which may be one that a scenario names
        later. Port 1 is left to it: when no other is free, it plugs in another hub there.
        """
        taken = {each.port for each in self._plugged.values()}
        return next((port for port in map(str, range(PORTS, 1, -1)) if port not in taken), None)

    def _gone_with(self, name: str) -> list[str]:
        """What goes when something is pulled: it, and all behind its port if it is a hub."""
        if name not in self._plugged:
            return []
        port = self._plugged[name].port
        below = [
            other
            for other, each in self._plugged.items()
            if port is not None and each.port is not None and each.port.startswith(f"{port}.")
        ]
        return [name, *below]

    def _let_go(self, command: str, arguments: dict[str, str]) -> None:
        def removed() -> bool | None:
            try:
                self._qmp.do(command, **arguments)
            except QmpError as error:
                if "in use" in str(error) or "is busy" in str(error):
                    return None
                raise
            return True

        self._until("the device let go", removed)


def _backend(path: Path | None) -> dict[str, Any]:
    """The other end of a serial line: the program that listens at a socket, or nothing."""
    if path is None:
        return {"type": "null", "data": {}}
    address = {"type": "unix", "data": {"path": str(path)}}
    return {
        "type": "socket",
        "data": {"addr": address, "server": False, "reconnect": RECONNECT_S},
    }
