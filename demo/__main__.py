"""`./run demo` and `./run demo search`: the two demonstrations."""

from __future__ import annotations

import signal
import sys

from demo import one_host, search


def main() -> int:
    """Run the demonstration that is asked for; also when it is told to end, it leaves nothing."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    match sys.argv[1:]:
        case ["search", *arguments]:
            return search.main(arguments)
        case arguments:
            return one_host.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
