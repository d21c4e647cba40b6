"""What the recogniser's own process is asked: `Learn` some words, or hear a `Sound`."""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass

from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import Lexicon
from nondum_speech.recogniser import Limits

LENGTH = struct.Struct("!I")


@dataclass(frozen=True, slots=True)
class Learn:
    """Hear these words from now on. Answered with None."""

    vocabulary: Vocabulary
    lexicon: Lexicon
    limits: Limits


def framed(value: object) -> bytes:
    """A request or an answer as it travels."""
    data = pickle.dumps(value)
    return LENGTH.pack(len(data)) + data
