"""A device that no driver of the kernel knows is asked through pyusb, at one port and the next."""

from __future__ import annotations

from tests.lab.lab import Lab
from tests.lab.plugins import card_reader, until_said

PAYLOAD = "org.example.reader"


def run(lab: Lab) -> str:
    """Plug a smart card reader in, have a worker ask it, pull it, plug it in elsewhere: again."""
    host = lab.host()
    stick = host.bring(lab.stick("reader", card_reader()), PAYLOAD)
    said = ""
    for port in ("5", "6"):
        reader = host.machine.plug_device("usb-ccid", port=port)
        host.until_component("reader", "ready")
        said = until_said(host, "reader", "answers")
        shown = host.machine.run("nondum devices")
        assert "reader (it)" in shown, shown
        host.machine.unplug(reader)
        host.until_component("reader", "waits for it")
        until_said(host, "reader", "nothing")
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    return said
