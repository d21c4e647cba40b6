"""A machine to try things out on: what is typed is run in it."""

from __future__ import annotations

import sys

from tests.lab.lab import Lab

HELP = """A machine with nondum runs. What you type is run in it, as root;
  plug IMAGE   plugs a stick in        pull STICK   pulls it out        Ctrl-D   ends it all"""


def talk(lab: Lab) -> int:
    """Boot a machine, and serve its person until the end of input."""
    host = lab.host()
    print(f"{HELP}\nits console: {host.machine.console}")
    while True:
        print("lab> ", end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            return 0
        match line.split():
            case ["plug", image]:
                print(host.machine.plug(lab.work / image))
            case ["pull", stick]:
                host.machine.pull(stick)
            case [_, *_]:
                outcome = host.machine.attempt(line, timeout_s=600)
                print(outcome.out, outcome.err, sep="", end="")
