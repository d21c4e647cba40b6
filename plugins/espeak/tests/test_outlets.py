"""Ways for a sentence to leave the machine, with programs that stand in for players."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

import pytest

from nondum_espeak import Folder, Player, find_outlet, find_player


def program(folder: Path, name: str, script: str) -> str:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)
    return str(path)


def test_player_gets_the_file_on_its_standard_input(tmp_path: Path) -> None:
    heard = tmp_path / "heard"
    asyncio.run(Player(program(tmp_path, "aplay", f"cat > {heard}"), "-q").play(b"RIFF"))
    assert heard.read_bytes() == b"RIFF"


@pytest.mark.parametrize("script", ["exit 3", None], ids=["fails", "is not there"])
def test_player_that_cannot_play_says_so(script: str | None, tmp_path: Path) -> None:
    command = program(tmp_path, "aplay", script) if script else str(tmp_path / "none")
    with pytest.raises(OSError):
        asyncio.run(Player(command).play(b"RIFF"))


def test_cancelled_playing_leaves_nothing_running(tmp_path: Path) -> None:
    started = tmp_path / "started"
    os.mkfifo(started)
    slow = program(tmp_path, "aplay", f"echo $$ > {started}; exec sleep 60")

    async def interrupted() -> int:
        playing = asyncio.create_task(Player(slow).play(b"RIFF"))
        pid = int(await asyncio.to_thread(started.read_text))
        playing.cancel()
        with pytest.raises(asyncio.CancelledError):
            await asyncio.wait_for(playing, 60)
        return pid

    pid = asyncio.run(interrupted())
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_files_are_counted_on(tmp_path: Path) -> None:
    asyncio.run(Folder(tmp_path / "out").play(b"one"))
    asyncio.run(Folder(tmp_path / "out").play(b"two"))
    said = sorted((tmp_path / "out").iterdir())
    assert [(p.name, p.read_bytes()) for p in said] == [
        ("said-000001.wav", b"one"),
        ("said-000002.wav", b"two"),
    ]


def test_player_is_chosen_by_what_there_is(tmp_path: Path) -> None:
    for name in ("aplay", "paplay"):
        program(tmp_path, name, f"echo {name} > {tmp_path}/chosen")
    sound = tmp_path / "snd"
    sound.mkdir()
    path = {"PATH": f"{tmp_path}:{os.defpath}"}
    assert find_player(path, sound) is None
    (sound / "pcmC0D0p").touch()
    for environment, name in ((path, "aplay"), ({**path, "PULSE_SERVER": "unix:/x"}, "paplay")):
        player = find_player(environment, sound)
        assert player is not None
        asyncio.run(player.play(b"RIFF"))
        assert (tmp_path / "chosen").read_text().strip() == name


def test_folder_that_is_named_goes_before_all_players(tmp_path: Path) -> None:
    program(tmp_path, "paplay", "exit 0")
    environment = {"PATH": str(tmp_path), "PULSE_SERVER": "unix:/x"}
    outlet = find_outlet("out", environment, scratch=tmp_path)
    assert isinstance(outlet, Folder)
    asyncio.run(outlet.play(b"RIFF"))
    assert (tmp_path / "out" / "said-000001.wav").exists()
    assert isinstance(find_outlet("", environment, scratch=tmp_path), Player)
