"""The recogniser's own process: `python -m nondum_speech.recogniser_process`.

Requests come in by standard input and are answered on standard output, one after the other, each a
length of four bytes and a pickle. Both ends are this plugin.
"""

from __future__ import annotations

import os
import pickle
import sys
from typing import Any, BinaryIO

from nondum_speech.recogniser import NOTHING, FreeHearing, Heard, Recogniser
from nondum_speech.requests import LENGTH, Learn, framed
from nondum_speech.sound import Sound


def main() -> None:
    """Answer until standard input ends."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever else is printed
    free: FreeHearing | None = None
    recogniser: Recogniser | None = None
    while (request := _read(sys.stdin.buffer)) is not None:
        answer: Heard | None = None
        if isinstance(request, Learn):
            free = free or FreeHearing()
            words, lexicon = request.vocabulary, request.lexicon
            recogniser = Recogniser(words, lexicon, free, request.limits)
        elif isinstance(request, Sound):
            answer = recogniser.hear(request) if recogniser else NOTHING
        out.write(framed(answer))
        out.flush()


def _read(source: BinaryIO) -> Any:
    head = source.read(LENGTH.size)
    return pickle.loads(source.read(*LENGTH.unpack(head))) if head else None


if __name__ == "__main__":
    main()
