"""A fleet made for one scenario, as its owner makes one: by the command line, here and there."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.lab.cache import call
from tests.lab.installed import Installed

NONDUM = (sys.executable, "-m", "nondum.cli")
KEY, CERTIFICATE, PUBLIC = "/run/lab/host.pub", "/run/lab/certificate", "/run/lab/fleet.pub"


class Fleet:
    """Hosts that it has admitted accept each other, and no other host."""

    def __init__(self, folder: Path) -> None:
        """Make its keys, in a new folder."""
        self._folder = folder
        call(*NONDUM, "keys", "fleet", "new", folder)

    def admit(self, host: Installed) -> None:
        """Certify a host that runs, and have it trust the fleet."""
        machine = host.machine
        key, certificate = self._folder / f"{host.name}.pub", self._folder / host.name
        key.write_text(
            machine.run(f"mkdir -p /run/lab && nondum peers key -o {KEY} >&2 && cat {KEY}")
        )
        call(*NONDUM, "keys", "fleet", "sign", key, "--fleet", self._folder, "-o", certificate)
        machine.put(CERTIFICATE, certificate.read_bytes())
        machine.put(PUBLIC, (self._folder / "fleet.pub").read_bytes())
        machine.run(f"nondum peers trust-fleet {PUBLIC} && nondum peers certify {CERTIFICATE}")
