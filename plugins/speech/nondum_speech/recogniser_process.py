"""The recogniser's own process: `python -m nondum_speech.recogniser_process`.

Requests come in by standard input and are answered on standard output, one after the other, each a
length of four bytes and a pickle. Both ends are this plugin.
"""

from __future__ import annotations

import os
import pickle
import sys
from typing import Any, BinaryIO

from nondum_speech.echo import EchoCanceller
from nondum_speech.recogniser import NOTHING, FreeHearing, Recogniser
from nondum_speech.requests import LENGTH, Learn, Piece, Says, framed
from nondum_speech.sound import Sound
from nondum_speech.spotting import StopSpotter, stop_phrases


def main() -> None:
    """Answer until standard input ends."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever else is printed
    ears = _Ears()
    while (request := _read(sys.stdin.buffer)) is not None:
        out.write(framed(ears.answer(request)))
        out.flush()


class _Ears:
    """All that this process hears with."""

    def __init__(self) -> None:
        self._free: FreeHearing | None = None
        self._recogniser: Recogniser | None = None
        self._spotter: StopSpotter | None = None
        self._stops: object = None
        self._canceller = EchoCanceller()

    def answer(self, request: object) -> object:
        """Do what is asked."""
        match request:
            case Learn():
                self._learn(request)
            case Sound():
                return self._recogniser.hear(request) if self._recogniser else NOTHING
            case Says(sound):
                if self._spotter:
                    self._spotter.begin(sound)
            case Piece(sound):
                return self._spotter.heard(sound) if self._spotter else ""
        return None

    def _learn(self, asked: Learn) -> None:
        self._free = self._free or FreeHearing()
        words, lexicon = asked.vocabulary, asked.lexicon
        self._recogniser = Recogniser(words, lexicon, self._free, asked.limits)
        # Words are learnt while the robot tells of what came, too: it goes on being listened to.
        stops = stop_phrases(words, lexicon)
        if stops != self._stops:
            self._stops = stops
            self._spotter = (
                StopSpotter(words, lexicon, self._canceller, self._nearest) if stops else None
            )

    def _nearest(self, sound: Sound) -> str:
        return self._recogniser.nearest(sound) if self._recogniser else ""


def _read(source: BinaryIO) -> Any:
    head = source.read(LENGTH.size)
    return pickle.loads(source.read(*LENGTH.unpack(head))) if head else None


if __name__ == "__main__":
    main()
