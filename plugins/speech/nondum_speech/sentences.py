"""Where sentences begin and end: WebRTC's voice activity detection, as PocketSphinx has it."""

from __future__ import annotations

from collections.abc import Iterator

from pocketsphinx import Endpointer

from nondum_speech.sound import RATE_HZ, Sound, from_bytes

LONGEST_S = 12.0
"""A longer sentence is cut: something hums."""
_WINDOW_S = 0.36
_RATIO = 0.8
"""A sentence begins or ends when so much of a window is voice, or is none. Half a second was too
long for "halt"; a pause after a name is shorter than 0.29 s."""
_STRICTNESS = 2
"""Of WebRTC's 0 to 3: white noise 10 dB below a voice is none; below 2 it was taken for voice, and
no sentence ended."""
_SILENT_SAMPLE = bytes(2)


class Sentences:
    """Cuts a flow of samples into sentences."""

    def __init__(self) -> None:
        self._endpointer = Endpointer(_WINDOW_S, _RATIO, _STRICTNESS, RATE_HZ)
        self._rest = b""
        self._voiced = bytearray()

    def feed(self, data: bytes) -> Iterator[Sound]:
        """Take more samples, and give each sentence that has ended with them."""
        self._rest += data
        size = self._endpointer.frame_bytes
        while len(self._rest) >= size:
            frame, self._rest = self._rest[:size], self._rest[size:]
            voiced = self._endpointer.process(frame)
            if voiced is not None:
                self._voiced += voiced
            if self._voiced and (not self._endpointer.in_speech or self._is_too_long()):
                yield self._taken()

    def ended(self) -> Iterator[Sound]:
        """No more samples come: give the sentence that was being said."""
        frame = self._rest[: len(self._rest) // 2 * 2]
        self._rest = b""
        # It takes no empty frame (IndexError), which is what whole frames leave behind.
        voiced = self._endpointer.end_stream(frame or _SILENT_SAMPLE)
        self._voiced += voiced or b""
        if self._voiced:
            yield self._taken()

    def _is_too_long(self) -> bool:
        return len(self._voiced) > LONGEST_S * RATE_HZ * 2

    def _taken(self) -> Sound:
        sentence = from_bytes(bytes(self._voiced))
        self._voiced.clear()
        return sentence


def sentences_of(sound: Sound) -> tuple[Sound, ...]:
    """The sentences of a recording."""
    cutter = Sentences()
    return (*cutter.feed(sound.to_bytes()), *cutter.ended())
