"""`./run demo` and `./run demo search`: the two demonstrations."""

from __future__ import annotations

import sys

from demo import one_host, search


def main() -> int:
    """Run the demonstration that is asked for."""
    match sys.argv[1:]:
        case ["search", *arguments]:
            return search.main(arguments)
        case arguments:
            return one_host.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
