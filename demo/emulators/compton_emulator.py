"""Program: a Compton camera on a pseudo-terminal, or a unix socket. Prints the path, no more."""

import sys
from pathlib import Path

if __name__ == "__main__":  # run as a program, from any folder
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from demo.emulators.compton import ComptonCamera
from demo.emulators.program import arguments, ports, ticks

TICK_S = 0.02


def main() -> None:
    """Send what the instrument would, in real time, until the parent process is gone."""
    given = arguments(__doc__ or "")
    camera = ComptonCamera(given.scenario)
    (port,) = ports(given, 1)
    print(port.path, flush=True)
    for wait_s in ticks(TICK_S, given.parent):
        port.read(wait_s)  # the instrument takes no commands
        port.write(camera.advance(TICK_S))


if __name__ == "__main__":
    main()
