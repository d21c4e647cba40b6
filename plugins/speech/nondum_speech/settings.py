"""What an integrator may set; see the README for each."""

from __future__ import annotations

from dataclasses import dataclass

from nondum_speech.recogniser import Limits


@dataclass(frozen=True, slots=True)
class Settings:
    """Where is listened, and how things are said."""

    microphone: str = "default"
    """A capture device of ALSA; empty: no microphone."""
    inbox: str = ""
    """Folder of WAV files to hear; empty: `inbox` in the component's scratch folder."""
    confidence: float = -0.85
    """What a sentence must reach to be taken as said; nearer zero is stricter."""
    stop_confidence: float = -1.15
    """The same for words that stop the robot."""
    stop_while_speaking: bool = True
    """Whether words that stop are listened for while the robot speaks. What other people say
    meanwhile is often taken for one."""
    said: str = ""
    """Folder for a WAV file of each sentence said; empty: the default sound device."""
    voice: str = "en-us"
    """A voice of eSpeak NG; `en-us+f2` is a variant of one."""
    words_per_minute: int = 160

    def __post_init__(self) -> None:
        if not 80 <= self.words_per_minute <= 450:
            raise ValueError("words_per_minute must lie between 80 and 450")
        if max(self.confidence, self.stop_confidence) > 0:
            raise ValueError("confidence and stop_confidence must not be above zero")

    @property
    def limits(self) -> Limits:
        """What sentences must reach."""
        return Limits(self.confidence, self.stop_confidence)
