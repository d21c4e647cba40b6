"""Program: a pan-tilt unit and its laser's relay on two pseudo-terminals, or unix sockets.

Prints the two paths, the unit's first, and nothing else. With `--log` it writes what the head and
the laser really did, one JSON object a line: time (the monotonic clock), angles, laser.
"""

import json
import sys
import time
from pathlib import Path
from typing import TextIO

if __name__ == "__main__":  # run as a program, from any folder
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from demo.emulators.pan_tilt import PanTiltUnit
from demo.emulators.program import arguments, ports, ticks
from demo.emulators.relay import Relay

TICK_S = 0.01
LOG_EVERY_S = 0.1


def main() -> None:
    """Answer in real time until the parent process is gone."""
    given = arguments(__doc__ or "")
    unit, relay = PanTiltUnit(given.scenario.pan_rad, given.scenario.tilt_rad), Relay()
    if given.scenario.seized:
        unit.seize()
    head, switch = ports(given, 2)
    print(head.path, switch.path, sep="\n", flush=True)
    log = given.log.open("a", encoding="utf-8") if given.log else None
    logged_s, before = 0.0, time.monotonic()
    for wait_s in ticks(TICK_S, given.parent):
        said = unit.receive(head.read(wait_s))
        was_closed = relay.closed
        relay.receive(switch.read(0))
        now = time.monotonic()
        head.write(said + unit.advance(now - before))
        before = now
        if log and (relay.closed != was_closed or now - logged_s >= LOG_EVERY_S):
            logged_s = now
            _write(log, now, unit, relay)


def _write(log: TextIO, now_s: float, unit: PanTiltUnit, relay: Relay) -> None:
    truth = {
        "at_s": round(now_s, 4),
        "pan_rad": unit.pan.angle_rad,
        "tilt_rad": unit.tilt.angle_rad,
        "laser": relay.closed,
    }
    log.write(json.dumps(truth) + "\n")
    log.flush()


if __name__ == "__main__":
    main()
