"""What an integrator may set; see the README for each."""

from __future__ import annotations

import string
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Settings:
    """How things are said."""

    report: str = "I have found: {thing}."
    """What `report` says; `{thing}` is the class, with blanks for hyphens."""
    said: str = ""
    """Folder for a WAV file of each sentence said; empty: the default sound device."""
    voice: str = "en-us"
    """A voice of eSpeak NG; `en-us+f2` is a variant of one."""
    words_per_minute: int = 160

    def __post_init__(self) -> None:
        names = {name for _, name, _, _ in string.Formatter().parse(self.report)}
        if not names <= {None, "thing"}:
            raise ValueError("report may hold {thing} and nothing else in braces")
        if not 80 <= self.words_per_minute <= 450:
            raise ValueError("words_per_minute must lie between 80 and 450")

    def sentence(self, class_id: str) -> str:
        """What is said of a class.

        >>> Settings().sentence("traffic-cone")
        'I have found: traffic cone.'
        """
        return self.report.format(thing=class_id.replace("-", " "))
