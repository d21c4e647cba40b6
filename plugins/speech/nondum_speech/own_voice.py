"""What is heard while one sentence is said, without the own voice.

Players start when they like: when the sentence begins to be heard is found by comparing it with
what is heard. Until then, what is heard waits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nondum_speech.echo import BLOCK, EchoCanceller, Waves, way_of
from nondum_speech.sound import RATE_HZ, Sound

LONGEST_WAY_S = 1.5
"""From a sentence's start until it is heard, with the player's start and the recorder's delay."""
_FIRST_LOOK_S, _LOOK_AGAIN_S, _LAST_LOOK_S = 0.6, 0.3, 2.4
EARLY = 64
"""Samples: what is heard first need not be the loudest."""
_PROOF_BLOCKS = 30
"""Half a second."""
_PROVEN = 0.3


@dataclass(frozen=True, slots=True)
class Power:
    """Of one block."""

    heard: float
    rest: float
    """Without the own voice."""


class OwnVoice:
    """Takes one sentence out of what is heard while it is said, and shortly after."""

    def __init__(self, said: Sound, canceller: EchoCanceller) -> None:
        self._said = said.samples.astype(np.float64)
        self._canceller = canceller
        self._waiting = np.zeros(0)
        self._played: Waves | None = None
        self._look_at = int(_FIRST_LOOK_S * RATE_HZ)
        self.is_audible = True
        """False: it was looked for, and is not heard."""
        self.is_taken_out = False
        """Whether, some half second long, little was left of what was heard."""
        self.powers: list[Power] = []
        """One for each block that `heard` has given."""
        self._own = 0.0
        self._said_then: list[Waves] = []

    @property
    def mean_power(self) -> float:
        """Of the own voice as it was taken out so far."""
        return self._own / max(1, len(self.powers))

    def said_in(self, begin: int, end: int) -> Sound:
        """What the robot itself said in these samples of all that `heard` has given."""
        first = begin // BLOCK
        blocks = self._said_then[first : end // BLOCK + 1]
        samples = np.concatenate([np.zeros(0), *blocks])
        return Sound(samples[begin - first * BLOCK : end - first * BLOCK].astype(np.int16))

    def heard(self, piece: Sound) -> Waves:
        """Take more of what is heard; give what is left of as much as can be told by now."""
        self._waiting = np.concatenate([self._waiting, piece.samples.astype(np.float64)])
        if self._played is None:
            self._look()
        if self._played is None:
            return np.zeros(0)
        blocks = len(self._waiting) // BLOCK
        ready, self._waiting = np.split(self._waiting, [blocks * BLOCK])
        return np.concatenate(
            [np.zeros(0), *(self._rest_of(block) for block in ready.reshape(blocks, BLOCK))]
        )

    def _look(self) -> None:
        """Find out when the sentence began to be heard."""
        length = len(self._waiting)
        if length < self._look_at:
            return
        self._look_at += int(_LOOK_AGAIN_S * RATE_HZ)
        way = way_of(self._said[:length], self._waiting, int(LONGEST_WAY_S * RATE_HZ))
        if way is not None:
            lead = max(0, way - EARLY)
            self._played = np.concatenate([np.zeros(lead), self._said])
        elif length >= _LAST_LOOK_S * RATE_HZ:
            self._played, self.is_audible = np.zeros(0), False

    def _rest_of(self, block: Waves) -> Waves:
        assert self._played is not None, "only asked when it is known"
        played, self._played = self._played[:BLOCK], self._played[BLOCK:]
        played = np.pad(played, (0, BLOCK - len(played)))
        self._said_then.append(played)
        rest, own = self._canceller.heard(played, block)
        self.powers.append(Power(float(np.mean(block**2)), float(np.mean(rest**2))))
        self._own += float(np.mean(own**2))
        if not self.is_taken_out and len(self.powers) >= _PROOF_BLOCKS:
            last = self.powers[-_PROOF_BLOCKS:]
            self.is_taken_out = sum(p.rest for p in last) < _PROVEN * sum(p.heard for p in last)
        return rest
