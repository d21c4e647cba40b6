"""What is said to the ears: words that stop, and sentences that are none."""

from __future__ import annotations

from benchmarks.speech import FAR, NEAR, PHRASES, VOCABULARY

from nondum.planning.asking import ASKED
from nondum.planning.stop_words import STOP_PATTERNS
from nondum_speech.grammar import Vocabulary

KNOWN = Vocabulary((*STOP_PATTERNS, *ASKED, *VOCABULARY.phrases), VOCABULARY.names, STOP_PATTERNS)
"""What a host with the shipped plugins tells those who listen, as `mind.sayings` does."""

ALIKE = (
    "top",
    "shop",
    "step",
    "stopped",
    "the shop is open",
    "the bus stop is over there",
    "we never stopped at the old house",
    "the top shelf is empty",
    "stop by for tea some day",
    "please step back a little",
    "hold the door please",
    "hold this for me",
    "a fault in the hall",
    "half past nine",
    "the frieze is old",
    "stand over there",
    "still water runs deep",
    "a board of wood",
    "don't mind him",
    "do not wait for me",
)
"""Sounds much like a word that stops, or has one in it, and stops nothing."""
OTHERS = (*PHRASES, *ASKED, *ALIKE, *NEAR, *FAR)
