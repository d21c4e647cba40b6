"""A microphone by ALSA's own recorder, arecord.

No binding of ALSA has wheels for every machine that nondum runs on; and a wheel's own copy of the
library would not know the machine's plugins and mixers. A program that hangs or crashes does no
harm to this process.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import shutil
from collections.abc import AsyncIterator, Mapping
from pathlib import Path

from nondum_speech.sound import RATE_HZ

PIECE_BYTES = 3200
"""A tenth of a second."""


class MicrophoneSilent(OSError):
    """Nothing comes from the microphone; the message says why."""


def find_recorder(
    environment: Mapping[str, str], sound_devices: Path = Path("/dev/snd")
) -> str | None:
    """arecord, where it is and there is something to record from."""
    if not any(sound_devices.glob("pcm*c")) and "PULSE_SERVER" not in environment:
        return None
    return shutil.which("arecord", path=environment.get("PATH", os.defpath))


async def recorded(recorder: str, device: str) -> AsyncIterator[bytes]:
    """Record until cancelled: 16-bit samples of one channel at `RATE_HZ`.

    ALSA's `plug` converts what the device cannot do. Raises `MicrophoneSilent` when it ends.
    """
    pipe, null = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
    command = (recorder, "-q", "-D", device, "-t", "raw", "-f", "S16_LE", "-c", "1")
    process = await asyncio.create_subprocess_exec(
        *command, "-r", str(RATE_HZ), stdin=null, stdout=pipe, stderr=null
    )
    assert process.stdout is not None
    try:
        with contextlib.suppress(asyncio.IncompleteReadError):
            while True:
                yield await process.stdout.readexactly(PIECE_BYTES)
        raise MicrophoneSilent(f"arecord -D {device} ended with status {await process.wait()}")
    finally:
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
        await process.wait()
