"""What the recogniser's own process is asked.

`Learn` some words; hear a `Sound` that is one sentence; or hear what comes while the robot itself
`Says` something, a `Piece` at a time.
"""

from __future__ import annotations

import pickle
import struct
from dataclasses import dataclass

from nondum_speech.grammar import Vocabulary
from nondum_speech.lexicon import Lexicon
from nondum_speech.recogniser import Limits
from nondum_speech.sound import Sound

LENGTH = struct.Struct("!I")


@dataclass(frozen=True, slots=True)
class Learn:
    """Hear these words from now on. Answered with None."""

    vocabulary: Vocabulary
    lexicon: Lexicon
    limits: Limits


@dataclass(frozen=True, slots=True)
class Says:
    """The robot says this from now on: what comes are pieces of what is heard meanwhile. Answered
    with None."""

    sound: Sound


@dataclass(frozen=True, slots=True)
class Piece:
    """What was heard next. Answered with words that stop, if somebody else said them, or ""."""

    sound: Sound


def framed(value: object) -> bytes:
    """A request or an answer as it travels."""
    data = pickle.dumps(value)
    return LENGTH.pack(len(data)) + data
