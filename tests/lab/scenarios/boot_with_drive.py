"""A drive that is in before the machine boots is at work without a hand; so after a restart."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.followed import Followed
from tests.lab.lab import Lab

PAYLOAD = "org.example.talker"


def run(lab: Lab) -> str:
    """Restart the daemon, reset the machine, and have it forget all before it boots once more."""
    host = lab.booted()
    host.start()
    stick = host.bring(lab.stick("talker", talker()), PAYLOAD)
    daemon = host.shown("MainPID")
    host.machine.run("systemctl restart nondum.service")
    assert host.shown("MainPID") != daemon
    host.until_payload(PAYLOAD, "active")
    host.machine.reset()
    Followed.follow(host).until_payload(PAYLOAD, "active")
    host.forget()
    host.machine.run("sync")
    host.machine.reset()
    Followed.follow(host).until_payload(PAYLOAD, "active")
    uptime_s = float(host.machine.run("cat /proc/uptime").split()[0])
    host.machine.pull(stick)
    host.until_payload(PAYLOAD, "gone")
    return f"first time: at work {uptime_s:.0f} s (emulated) after the kernel began"
