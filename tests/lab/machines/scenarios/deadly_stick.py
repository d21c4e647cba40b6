"""A stick whose reading kills the daemon time and again is left alone, and the daemon says so."""

from __future__ import annotations

from tests.lab.machines.agent import TOO_LONG
from tests.lab.machines.lab import Lab
from tests.lab.plugins import talker

MOST = 8
"""Kills that are tried; five must do."""
KILL = """
staged() { ls /var/lib/nondum/staging 2>/dev/null | grep -q .; }
while staged; do sleep 0.02; done
until staged; do sleep 0.02; done
kill -KILL $(systemctl show --value -p MainPID nondum.service)
"""


def run(lab: Lab) -> str:
    """Kill the daemon whenever it copies from the stick."""
    host = lab.host()
    stick = host.machine.plug(lab.stick("talker", talker()))
    kills = 0
    while kills < MOST:
        if host.machine.attempt(KILL, timeout_s=60).status == TOO_LONG:
            break
        kills += 1
        host.wait_until_started()
    view = host.until("a status", lambda view: view)
    states = [row["state"] for row in view["payloads"]]
    said = [text for row in (*view["drives"], *view["payloads"]) for text in row["problems"]]
    host.machine.pull(stick)
    assert kills <= 5, f"killed {kills} times"
    assert "active" not in states, f"{kills} kills, and it is {states}"
    assert kills and said, f"{kills} kills, and nothing is said"
    return f"left alone after {kills}: {said[0].split()[0]}"
