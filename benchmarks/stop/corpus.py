"""What is said to the speech plugin: words that stop, and other sentences."""

from __future__ import annotations

from benchmarks.speech import FAR, NEAR, PHRASES, VOCABULARY

from nondum.planning.words.asking import ASKED
from nondum.planning.words.stop_words import stop_patterns
from nondum_speech.grammar import Vocabulary

HOST = "rover"
_TO = "{addressee}"
_STOPS = stop_patterns(_TO)
KNOWN = Vocabulary(
    (*_STOPS, *(f"[{_TO}] {said}" for said in (*ASKED, *VOCABULARY.phrases))),
    {**VOCABULARY.names, "addressee": (HOST,)},
    _STOPS,
)
"""What a host called rover with the shipped plugins tells those who listen, as `mind.sayings`
does."""

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
OF_ROBOT = (
    "I was asked to follow you, and I do, with recorded-camera, people-detector and mobile-base.",
    "I can follow you and look for you; to point at something I need a target.",
    "I am doing nothing; no one has given me a goal.",
    "I have found people.",
    "speech heard 'follow me': that is goal 3",
    "speech heard 'stop': goal 3 is halted",
    "org.nondum.thermal-camera is refused: the payload is not signed",
    "the host scout is here",
    "the host scout is gone: it does not answer any more",
    "goal 2, 'search for people', is suspended",
    "goal 1 was reached",
    "drive usb carries no payload",
    "the drive may be pulled: org.nondum.speaker works, and stays when it is gone",
    "there is no image, which people-detector.detect needs, for visual-tracker.track",
    "recorded-camera may use: video",
    "org.nondum.people-detector 0.2.0 took over from release 1",
    "halting visual-tracker.track tracker people steering rover person",
    "the catalogue is written again, with all that happened meanwhile",
    "safe mode is left: payloads are taken in again",
    "the clock is set: it is believed again",
    "pan-tilt-unit waits for its device: plug it in",
    "compton-camera goes on without a condition: it ended with an error",
    "everything was stopped; nothing is planned until somebody gives a goal",
    "the stop key is not there",
)
"""What a robot with the shipped plugins says: of each kind of sentence one, and some with a word in
them that stops."""
OTHERS = (*PHRASES, *ASKED, *ALIKE, *NEAR, *FAR)
