"""What eSpeak NG said once, for tests: it says no text twice alike.

`PYTHONPATH=plugins/espeak:plugins/speech python plugins/speech/tests/recorded.py` records again.
"""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from nondum_speech.espeak import Espeak
from nondum_speech.sound import Samples, Sound

FILE = Path(__file__).with_suffix(".npz")
ROBOT = "I can follow you and look for you, and I wait for somebody to plug in a target."
"""What the robot says."""
ROBOT_OF_STOPS = "Stop! The stop key is not there. Stand still!"
OTHER = "follow me through the facility"
"""What a person says who wants something else; `STOPPING`: who wants it to stop."""
STOPPING = ("stop", "freeze", "hold still")


def said(text: str) -> Sound:
    """One of the above."""
    return Sound(_recorded()[text])


@cache
def _recorded() -> dict[str, Samples]:
    with np.load(FILE) as sounds:
        return dict(sounds)


def record() -> None:
    """Make the file."""
    texts = {
        **dict.fromkeys((ROBOT, ROBOT_OF_STOPS), "en-us"),
        **dict.fromkeys((OTHER, *STOPPING), "en-us+f2"),
    }
    with tempfile.TemporaryDirectory() as folder:
        espeak = Espeak(Path(folder))
        sounds = {
            text: espeak.say(text, voice=voice, words_per_minute=160).samples
            for text, voice in texts.items()
        }
    np.savez_compressed(FILE, allow_pickle=False, **sounds)


if __name__ == "__main__":
    record()
