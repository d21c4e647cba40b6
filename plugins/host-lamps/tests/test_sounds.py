"""A tune for each state, played by a program that a script stands in for."""

from __future__ import annotations

import asyncio
import io
import wave
from pathlib import Path

import pytest

from nondum.host.core.feedback_state import NOTHING, State, StateReason
from nondum.sdk.errors import InstallFailed
from nondum_host_lamps.player import Player
from nondum_host_lamps.tones import TUNES, wav

REFUSED = StateReason(State.REFUSED, "drive a", "one")


def script(folder: Path, text: str) -> str:
    path = folder / "program"
    path.write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
    path.chmod(0o755)
    return str(path)


def test_a_player_hears_a_tune_once_for_each_state(tmp_path: Path) -> None:
    heard = tmp_path / "heard"
    player = Player([script(tmp_path, f"cat >> {heard}")])

    async def shown() -> None:
        await player.show(REFUSED)
        await player.show(StateReason(State.REFUSED, "drive b", "another"))

    asyncio.run(shown())
    assert heard.read_bytes() == wav(TUNES[State.REFUSED])


@pytest.mark.parametrize(
    ("text", "says"), [("echo no such card; exit 1", "no such card"), (None, "cannot be run")]
)
def test_a_player_that_cannot_play_is_told(tmp_path: Path, text: str | None, says: str) -> None:
    command = script(tmp_path, text) if text else str(tmp_path / "none")
    with pytest.raises(InstallFailed, match=says) as failed:
        asyncio.run(Player([command]).show(NOTHING))
    assert failed.value.code == "SOUND_FAILED"


@pytest.mark.parametrize("state", State)
def test_tunes_are_sound_files_of_a_second_at_most(state: State) -> None:
    with wave.open(io.BytesIO(wav(TUNES[state]))) as file:
        assert (file.getnchannels(), file.getsampwidth()) == (1, 2)
        assert 0.1 < file.getnframes() / file.getframerate() <= 1.2


def test_no_two_tunes_are_alike() -> None:
    assert len(set(map(tuple, TUNES.values()))) == len(State)
