"""A worker that is a service of systemd and forks without end is ended; one that spins is told."""

from __future__ import annotations

from functools import partial

from tests.lab.installed import Installed
from tests.lab.lab import Lab
from tests.lab.plugins import doer

CONFIGURATION = 'confinement = "2"\ntasks = 64\n'
FORK = """while True:
    try:
        if os.fork() == 0:
            time.sleep(3600)
    except OSError:
        await asyncio.sleep(0.001)"""
SPIN = """import threading
def spin():
    while True:
        pass
threading.Thread(target=spin, daemon=True).start()"""
DUP = """held = []
while True:
    try:
        held.append(os.dup(1))
    except OSError:
        await asyncio.sleep(0.05)"""
ENDS = {"forks": (FORK, "WORKER_TASKS"), "spins": (SPIN, "WORKER_CPU"), "dups": (DUP, "WORKER_FDS")}
UNSEEN = "dups"
"""Before Linux 6.2 nobody but root learns how many files a process of another user has open."""


def run(lab: Lab) -> str:
    """One payload after the other, each with a goal that it never reaches well."""
    host = lab.host(more=CONFIGURATION)
    is_seen = tuple(map(int, host.machine.run("uname -r").split(".")[:2])) >= (6, 2)
    codes = []
    for name, (body, code) in ENDS.items():
        if name != UNSEEN or is_seen:
            stick = host.bring(lab.stick(name, doer(name, body)), f"org.example.{name}")
            daemon = host.shown("MainPID")
            host.machine.run(f'nondum goal --pddl "({name}-done self)"')
            codes.append(host.machine.until(code, partial(_told, host, name, code)))
            assert host.shown("MainPID") == daemon, "the daemon went, too"
            host.machine.pull(stick)
            host.until_payload(f"org.example.{name}", "gone")
    return ", ".join(codes)


def _told(host: Installed, component: str, code: str) -> str | None:
    """The code, once the journal has it."""
    said = host.machine.run(f"nondum journal --json --subject {component}")
    return code if code in said else None
