"""WAV files of any kind become 16 kHz, one channel."""

from __future__ import annotations

import wave
from pathlib import Path

import numpy as np
import pytest

from nondum_speech.sound import Sound, SoundInvalid, from_bytes, read_wav


def write(path: Path, *, rate_hz: int = 16_000, channels: int = 1, width: int = 2) -> Path:
    """A second of a 440 Hz tone at half of full scale."""
    tone = 0.5 * np.sin(2 * np.pi * 440 * np.arange(rate_hz) / rate_hz)
    if width == 1:
        data = (tone * 127 + 128).astype(np.uint8).tobytes()
    else:
        whole = (tone * (2 ** (8 * width - 1) - 1)).astype("<i4")
        data = whole.view(np.uint8).reshape(-1, 4)[:, :width].tobytes()
    samples = [data[i : i + width] * channels for i in range(0, len(data), width)]
    with wave.open(str(path), "wb") as wav:
        wav.setnchannels(channels)
        wav.setsampwidth(width)
        wav.setframerate(rate_hz)
        wav.writeframes(b"".join(samples))
    return path


@pytest.mark.parametrize(
    "form",
    [
        {},
        {"rate_hz": 44_100, "channels": 2},
        {"rate_hz": 8000},
        {"width": 1},
        {"width": 3, "rate_hz": 48_000},
        {"width": 4},
    ],
    ids=str,
)
def test_any_form_is_the_same_sound(tmp_path: Path, form: dict[str, int]) -> None:
    sound = read_wav(write(tmp_path / "tone.wav", **form))
    assert sound.seconds == pytest.approx(1.0, abs=0.01)
    spectrum = np.abs(np.fft.rfft(sound.samples[1000:15_000]))
    assert np.argmax(spectrum) * 16_000 / 14_000 == pytest.approx(440, abs=2)
    assert np.std(sound.samples[1000:15_000]) == pytest.approx(0.5 * 32768 / 2**0.5, rel=0.02)


def test_wav_of_a_sound_is_that_sound(tmp_path: Path) -> None:
    sound = Sound(np.array([0, 1, -32768, 32767], np.int16))
    (tmp_path / "s.wav").write_bytes(sound.to_wav())
    assert np.array_equal(read_wav(tmp_path / "s.wav").samples, sound.samples)
    assert np.array_equal(from_bytes(sound.to_bytes()).samples, sound.samples)


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        (lambda data: b"", "no WAV file"),
        (lambda data: b"ID3" + data, "no WAV file"),
        (lambda data: data[:1000], "ends too early"),
        (lambda data: data[:24] + (3).to_bytes(4, "little") + data[28:], "are no speech|longer"),
    ],
    ids=["empty", "another format", "cut off", "three samples a second"],
)
def test_file_that_is_no_speech_is_told(tmp_path: Path, damage, why: str) -> None:  # type: ignore[no-untyped-def]
    path = write(tmp_path / "tone.wav")
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(SoundInvalid, match=why):
        read_wav(path)


def test_long_recording_is_no_sentence(tmp_path: Path) -> None:
    (tmp_path / "long.wav").write_bytes(Sound(np.zeros(61 * 16_000, np.int16)).to_wav())
    with pytest.raises(SoundInvalid, match="longer than 60 s"):
        read_wav(tmp_path / "long.wav")
