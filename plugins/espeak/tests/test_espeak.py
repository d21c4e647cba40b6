"""eSpeak NG as its wheel carries it."""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import wave
from pathlib import Path

import espeakng_loader
import pytest

from nondum_espeak import Espeak, VoiceUnknown

SPEAK = """
import sys
from pathlib import Path
import espeakng_loader
espeakng_loader.get_data_path = lambda: sys.argv[1]
from nondum_espeak import Espeak
print(Espeak(Path(sys.argv[2])).phonemes("hello", voice="en-us"))
"""


@pytest.fixture(scope="module")
def espeak(tmp_path_factory: pytest.TempPathFactory) -> Espeak:
    """The one library of this process."""
    return Espeak(tmp_path_factory.mktemp("espeak"))


def test_speed_is_kept(espeak: Espeak) -> None:
    slow, quick = (
        espeak.say("search for people", voice="en-us", words_per_minute=speed).seconds
        for speed in (100, 200)
    )
    assert 1.5 < slow / quick < 2.5


def test_unknown_voice_is_refused(espeak: Espeak) -> None:
    with pytest.raises(VoiceUnknown, match="'klingonese'"):
        espeak.say("hello", voice="klingonese", words_per_minute=160)


def test_sentence_is_a_wav_file(espeak: Espeak) -> None:
    said = espeak.say("search for people", voice="en-us", words_per_minute=160)
    with wave.open(io.BytesIO(said.to_wav())) as wav:
        assert (wav.getnchannels(), wav.getsampwidth()) == (1, 2)
        assert wav.getnframes() / wav.getframerate() == pytest.approx(said.seconds)
        assert wav.readframes(wav.getnframes()) == said.samples  # x86 and ARM are little-endian


@pytest.mark.parametrize("length", [100, 150, 160, 170, 250])
def test_data_are_found_however_long_their_path(tmp_path: Path, length: int) -> None:
    """Venvs lie deep; the library cuts off long paths. In a separate process: it looks once."""
    data = tmp_path / ("d" * max(1, length - len(str(tmp_path)) - 1))
    shutil.copytree(espeakng_loader.get_data_path(), data)
    (tmp_path / "s").mkdir()
    command = [sys.executable, "-c", SPEAK, data, tmp_path / "s"]
    said = subprocess.run(command, capture_output=True, text=True, check=True, cwd=Path.cwd())
    assert said.stdout.strip() == "h_ə_l_ˈoʊ"
