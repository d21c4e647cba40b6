"""A daemon of the version before that writes down each message to its peers. `make.py` starts it.

    CHECKOUT/.venv/bin/python recorded_daemon.py FILE host run …

One message a line, in hexadecimal digits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nondum.host.cli.main import main

from nondum.transport.peers import messages


def recording(encode: Callable[[Any], bytes], file: Path) -> Callable[[Any], bytes]:
    """The same function, which also writes down what it gives."""

    def recorded(message: Any) -> bytes:
        data = encode(message)
        with file.open("a", encoding="ascii") as out:
            out.write(f"{data.hex()}\n")
        return data

    return recorded


def record(file: Path) -> None:
    """Have what a host says to peers written down."""
    encode = messages.encode
    for module in list(sys.modules.values()):  # each has imported it by its name
        if getattr(module, "encode", None) is encode:
            module.encode = recording(encode, file)


if __name__ == "__main__":
    record(Path(sys.argv.pop(1)))
    main()
