"""How a state sounds: a few short tones, told apart by number, rhythm and direction."""

from __future__ import annotations

import array
import io
import math
import sys
import wave
from collections.abc import Iterator, Mapping, Sequence

from nondum.host.core.feedback_state import State
from nondum.sdk.frozen import frozen

RATE_HZ = 16_000
LOUDNESS = 0.4
"""Of the loudest."""
_EDGE_S = 0.005
"""In which a tone swells and fades: without, it clicks."""


@frozen
class Tone:
    """A tone, or silence where its pitch is 0."""

    hertz: float
    seconds: float


_REST = Tone(0.0, 0.08)
TUNES: Mapping[State, Sequence[Tone]] = {
    State.READY: (Tone(660, 0.35),),
    State.WORKING: (Tone(440, 0.08), _REST, Tone(440, 0.08)),
    State.SAFE: (Tone(523, 0.12), _REST, Tone(784, 0.3)),
    State.REFUSED: (Tone(440, 0.15), _REST, Tone(330, 0.15), _REST, Tone(220, 0.5)),
    State.HELP: (
        Tone(880, 0.2),
        _REST,
        Tone(587, 0.2),
        _REST,
        Tone(880, 0.2),
        _REST,
        Tone(587, 0.2),
    ),
}
"""One long; two quick low; rising; falling; up and down."""


def wav(tune: Sequence[Tone]) -> bytes:
    """A tune as a WAV file: PCM, 16 bits, one channel."""
    samples = array.array("h", (s for tone in tune for s in _samples(tone)))
    if sys.byteorder == "big":
        samples.byteswap()
    out = io.BytesIO()
    with wave.open(out, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE_HZ)
        file.writeframes(samples.tobytes())
    return out.getvalue()


def _samples(tone: Tone) -> Iterator[int]:
    count, edge = round(tone.seconds * RATE_HZ), _EDGE_S * RATE_HZ
    for n in range(count):
        swell = min(1.0, n / edge, (count - n) / edge)
        yield round(32767 * LOUDNESS * swell * math.sin(2 * math.pi * tone.hertz * n / RATE_HZ))
