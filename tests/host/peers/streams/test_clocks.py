"""Stamps of another host are told by this one's clock. Source: time_namespaces(7)."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest
from tests.host.peers.streams.hosts import HERE, Over, pair, sent

from nondum.sdk.messages import Header, Text

pytestmark = [pytest.mark.anyio, pytest.mark.daemon]

AHEAD_S = 1000


async def test_stamps_are_told_by_the_readers_clock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The owner's bridge runs by a clock that is ahead, and so is what it is given to send."""
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nexec unshare -T --monotonic {AHEAD_S} {sys.executable} "$@"\n')
    python.chmod(0o755)
    async with pair() as hosts:
        with monkeypatch.context() as elsewhere:
            elsewhere.setattr(sys, "executable", str(python))
            async with hosts.owner.kept():
                pass
        producer, grant, _ = await hosts.export("text")
        number = await hosts.reader.import_("text", HERE, grant, Over())
        reader = await hosts.reading(number, "text")
        begun_s = time.monotonic()
        async with sent(
            producer, lambda seq: Text(Header(time.monotonic() + AHEAD_S, "eye", seq), "hello")
        ):
            message = await reader.until()
    assert isinstance(message, Text)
    assert begun_s - 0.5 < message.header.stamp_s < time.monotonic() + 0.5
    assert (message.header.frame_id, message.text) == ("eye", "hello")
