"""Run nondum's tests: `python -m tests`, which `./run tests` and `./run quick` call.

python -m tests                     every behaviour once (tests/README.md)
python -m tests --checks PYTHON     also lint, types, doctests and an emulated machine, with
                                    the tox of that Python
python -m tests --quick             what needs no process, in a minute
python -m tests PLACE… [OPTION…]    some tests, with pytest's options
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence

from tests.runner import chosen, full, quick


def main(arguments: Sequence[str]) -> int:
    """Run what was asked for; the exit status."""
    match list(arguments):
        case []:
            return full.run(tox=())
        case ["--checks", python]:
            return full.run(tox=(python, "-m", "tox"))
        case ["--quick", *rest]:
            return quick.run(rest)
        case some:
            return chosen.run(some)


if __name__ == "__main__":
    # A shell starts what runs in the background deaf to Ctrl-C; some tests press it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(main(sys.argv[1:]))
