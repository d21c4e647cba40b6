"""A voice by espeak-ng and a player, as far as the machine has them."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

TIMEOUT_S = 30.0


@dataclass(frozen=True, slots=True)
class Voice:
    """Programs that can be used; None where there is none."""

    synthesiser: str | None
    player: tuple[str, ...] | None
    """Command that plays a WAV file from its standard input."""

    async def say(self, text: str, *, language: str, words_per_minute: int) -> bool:
        """Speak, and return when it has been said; False when nothing could be heard.

        Nothing is left running when it is cancelled.
        """
        if self.synthesiser is None or self.player is None:
            return False
        speed = str(words_per_minute)
        speak = (self.synthesiser, "--stdin", "--stdout", "-v", language, "-s", speed)
        sound = await _run(speak, text.encode())
        return sound is not None and await _run(self.player, sound) is not None


def find_voice(environment: Mapping[str, str], sound_devices: Path = Path("/dev/snd")) -> Voice:
    """Look what there is: espeak-ng, and aplay where there is a sound card or paplay where there
    is a sound server."""
    player: tuple[str, ...] | None = None
    path = environment.get("PATH", os.defpath)
    if "PULSE_SERVER" in environment and (paplay := shutil.which("paplay", path=path)):
        player = (paplay,)
    elif any(sound_devices.glob("pcm*p")) and (aplay := shutil.which("aplay", path=path)):
        player = (aplay, "-q", "-")
    return Voice(shutil.which("espeak-ng", path=path), player)


async def _run(command: tuple[str, ...], data: bytes) -> bytes | None:
    """Feed a program and give its output; None when it cannot be run, fails or takes too long."""
    pipe, null = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
    try:
        process = await asyncio.create_subprocess_exec(
            *command, stdin=pipe, stdout=pipe, stderr=null
        )
    except OSError:
        return None
    try:
        async with asyncio.timeout(TIMEOUT_S):
            output, _ = await process.communicate(data)
    except TimeoutError:
        return None
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
    return output if process.returncode == 0 else None
