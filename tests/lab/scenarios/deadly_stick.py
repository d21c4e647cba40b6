"""A stick that kills the daemon five times is left alone at the next start, which says so."""

from __future__ import annotations

from tests.daemon.plugins import talker
from tests.lab.agent import TOO_LONG
from tests.lab.installed import Installed
from tests.lab.lab import Lab

MOST = 8
"""Kills that are tried; five must do."""
PAYLOAD = "org.example.talker"
KILL = """
staged() { ls /var/lib/nondum/staging 2>/dev/null | grep -q .; }
while staged; do sleep 0.02; done
until staged; do sleep 0.02; done
kill -KILL $(systemctl show --value -p MainPID nondum.service)
"""


def run(lab: Lab) -> str:
    """Kill the daemon whenever it copies from the stick; reset the machine; pull and plug it in."""
    host = lab.booted()
    host.start()
    image = lab.stick("talker", talker())
    stick = host.machine.plug(image)
    kills = _killed(host)
    assert kills == 5, f"killed {kills} times"
    _see_left_alone(host)
    host.machine.reset()
    host.wait_until_started()
    said = _see_left_alone(host)
    host.machine.pull(stick)
    host.until("the stick is gone", lambda view: None if view["drives"] else True)
    host.bring(image, PAYLOAD)
    return f"left alone after {kills}, after a boot, too: {said}"


def _killed(host: Installed) -> int:
    """How often the daemon could be killed while it copied."""
    for kills in range(MOST):
        if host.machine.attempt(KILL, timeout_s=60).status == TOO_LONG:
            return kills
        host.wait_until_started()
    return MOST


def _see_left_alone(host: Installed) -> str:
    """What people are told of it, and what to do about it; answers its code."""
    host.machine.until("the stick has been looked at", lambda: _has_looked(host))
    said = host.machine.until("it is told", lambda: _told(host))
    assert "5 daemons in a row ended while they were at it, so it is left alone" in said, said
    assert "pull it and plug it in again" in said, said
    explained = host.machine.run("nondum explain QUARANTINED")
    assert "QUARANTINED" in explained, explained
    journal = host.machine.run("nondum journal --limit 1000")
    assert "QUARANTINED" in journal, "the journal does not tell"
    assert not host.machine.run("ls /var/lib/nondum/venvs").split(), "something was installed"
    return "QUARANTINED"


def _has_looked(host: Installed) -> bool | None:
    """Whether this daemon has: what is pulled before that is forgotten only after a while."""
    journal = host.machine.attempt("nondum journal --limit 1000").out
    return True if "DriveRead" in journal.rpartition("HostStarted")[2] else None


def _told(host: Installed) -> str | None:
    """`nondum status`, once it has something to say of the drive; its lines run together."""
    said = " ".join(host.machine.attempt("nondum status").out.split())
    return said if "QUARANTINED" in said else None
