"""How a sentence that was made leaves the machine: by a sound device, or as a WAV file."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

TIMEOUT_S = 30.0


class Outlet(Protocol):
    """Takes what is said, as WAV files."""

    async def play(self, wav: bytes) -> None:
        """Let it be heard; return when it has been. Raises `OSError`, `TimeoutError`."""
        ...


class Player:
    """A sound device, by aplay or paplay."""

    def __init__(self, *command: str) -> None:
        """`command` plays a WAV file from its standard input."""
        self._command = command

    async def play(self, wav: bytes) -> None:
        """Play, and leave nothing running when cancelled."""
        pipe, null = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
        process = await asyncio.create_subprocess_exec(
            *self._command, stdin=pipe, stdout=null, stderr=null
        )
        try:
            async with asyncio.timeout(TIMEOUT_S):
                await process.communicate(wav)
        finally:
            if process.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    process.kill()
                await process.wait()
        if process.returncode != 0:
            raise OSError(f"{self._command[0]} ended with status {process.returncode}")


class Folder:
    """A folder with a file for each sentence: `said-000001.wav`, counted on."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        numbers = (path.stem.removeprefix("said-") for path in folder.glob("said-*.wav"))
        self._number = max((int(n) for n in numbers if n.isdigit()), default=0)

    async def play(self, wav: bytes) -> None:
        """Write a file, whole or not at all."""
        self._number += 1
        unfinished = self._folder / f"said-{self._number:06}.part"
        unfinished.write_bytes(wav)
        unfinished.rename(unfinished.with_suffix(".wav"))


def find_outlet(said: str, environment: Mapping[str, str], *, scratch: Path) -> Outlet | None:
    """The folder `said`, if it is named (a relative one lies in `scratch`); else a player; None
    where nothing can be heard."""
    return Folder(scratch / said) if said else find_player(environment)


def find_player(
    environment: Mapping[str, str], sound_devices: Path = Path("/dev/snd")
) -> Player | None:
    """paplay where there is a sound server, aplay where there is a sound card."""
    path = environment.get("PATH", os.defpath)
    if "PULSE_SERVER" in environment and (paplay := shutil.which("paplay", path=path)):
        return Player(paplay)
    if any(sound_devices.glob("pcm*p")) and (aplay := shutil.which("aplay", path=path)):
        return Player(aplay, "-q", "-")
    return None
