"""The plugin on the bench: what is said is heard again."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from nondum.sdk import WorkerFailed

PLUGIN = "nondum_speech.plugin:Speech"
WORDS = {
    "phrases": ["[please] follow {class}", "[please] point at {target}", "search for {class}"],
    "names": {"class": ["me", "people"], "target": ["radiation source"]},
}


@pytest.fixture
def folders(tmp_path: Path) -> dict[str, object]:
    """Settings of a machine without a sound card: files in, files out."""
    return {
        "microphone": "",
        "inbox": str(tmp_path / "inbox"),
        "said": str(tmp_path / "said"),
    }


def say(bench: Any, tmp_path: Path, text: str) -> Path:
    """Have the plugin say something; give the WAV file of it."""
    before = set((tmp_path / "said").glob("*.wav"))
    bench.ask("speak", text=text)
    (said,) = set((tmp_path / "said").glob("*.wav")) - before
    return said


def test_sentence_that_was_said_is_heard(
    worker: Any, folders: dict[str, object], tmp_path: Path
) -> None:
    bench = worker(PLUGIN, settings=folders)
    said = say(bench, tmp_path, "Please point at the radiation source.")
    bench.ask("learn_words", vocabulary=WORDS)
    said.rename(tmp_path / "inbox" / "one.wav")
    assert bench.ask("listen") == {"words": "please point at the radiation source"}
    assert [path.name for path in (tmp_path / "inbox").iterdir()] == ["one.wav.heard"]
