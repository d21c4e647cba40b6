"""The recogniser's own process: `python -m nondum_speech.recogniser_process`.

Requests come in by standard input and are answered on standard output, one after the other, each a
length of four bytes and a pickle. Both ends are this plugin.
"""

from __future__ import annotations

import os
import pickle
import sys
from typing import Any, BinaryIO

from pywebrtc_audio import EchoCanceller

from nondum_speech.interruptions import Interruptions
from nondum_speech.own_voice import OwnVoice
from nondum_speech.recogniser import NOTHING, FreeHearing, Recogniser
from nondum_speech.requests import LENGTH, Learn, Piece, Says, framed
from nondum_speech.sound import RATE_HZ, Sound


def main() -> None:
    """Answer until standard input ends."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever else is printed
    handler = _RequestHandler()
    while (request := _read(sys.stdin.buffer)) is not None:
        out.write(framed(handler.answer(request)))
        out.flush()


class _RequestHandler:
    """Answers requests, with the vocabulary that was learnt last."""

    def __init__(self) -> None:
        self._free: FreeHearing | None = None
        self._recogniser: Recogniser | None = None
        self._interruptions: Interruptions | None = None
        self._canceller = EchoCanceller(RATE_HZ)

    def answer(self, request: object) -> object:
        """Carry out one request, and return its answer."""
        match request:
            case Learn(vocabulary, lexicon, limits):
                self._free = self._free or FreeHearing()
                self._recogniser = Recogniser(vocabulary, lexicon, self._free, limits)
            case Sound():
                return self._recogniser.hear(request) if self._recogniser else NOTHING
            case Says(sound):
                self._interruptions = Interruptions(OwnVoice(sound, self._canceller))
            case Piece(sound):
                return self._stop_in(sound)
        return None

    def _stop_in(self, piece: Sound) -> str:
        """Find words that stop, at most once while the robot says one sentence."""
        if self._interruptions is None or self._recogniser is None:
            return ""
        said = (self._recogniser.stop_in(other) for other in self._interruptions.feed(piece))
        words = next(filter(None, said), "")
        if words:
            self._interruptions = None
        return words


def _read(source: BinaryIO) -> Any:
    head = source.read(LENGTH.size)
    return pickle.loads(source.read(*LENGTH.unpack(head))) if head else None


if __name__ == "__main__":
    main()
