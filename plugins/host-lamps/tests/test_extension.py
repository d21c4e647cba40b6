"""What the host finds, and what it is given for its configuration."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from nondum.host.config.host_config import HostConfig
from nondum.host.config.parsing import parse
from nondum.host.core.feedback_state import NOTHING
from nondum.host.core.records.snapshot import Snapshot
from nondum.host.extension.hookspecs import Host
from nondum.host.extension.loading import Extensions
from nondum.sdk.errors import InstallFailed
from nondum_host_lamps.extension import NAME, feedback_outputs
from nondum_host_lamps.lamp_output import LampOutput
from nondum_host_lamps.player import Player

LAMPS = 'lamps = ["no-such-lamp"]'
PLAYER = 'player = ["/usr/bin/aplay", "-q"]'


def host(folder: Path, *lines: str) -> Host:
    """What an extension is given, with these lines under [feedback]."""

    async def say(text: str) -> None:
        raise AssertionError(text)

    config = parse("\n".join(("[feedback]", *lines)), "host.toml", HostConfig())
    return Host(config, folder, lambda: Snapshot("spot", 1), say, list)


@pytest.mark.parametrize(
    ("lines", "outputs"),
    [
        ((), []),
        ((LAMPS,), [LampOutput]),
        ((PLAYER,), [Player]),
        ((PLAYER, LAMPS), [LampOutput, Player]),
    ],
    ids=["nothing", "lamps", "player", "both"],
)
def test_there_is_an_output_for_each_key_that_is_set(
    tmp_path: Path, lines: tuple[str, ...], outputs: list[type]
) -> None:
    assert [type(output) for output in feedback_outputs(host(tmp_path, *lines))] == outputs


def test_host_finds_it_and_lacks_no_extension_then(tmp_path: Path) -> None:
    extensions = Extensions()
    extensions.note_missing(host(tmp_path, LAMPS, PLAYER).config)
    assert extensions.manager.has_plugin(NAME)
    assert not extensions.problems


def test_a_lamp_that_is_not_there_is_told_and_its_file_is_not_kept(tmp_path: Path) -> None:
    (lamps,) = feedback_outputs(host(tmp_path, LAMPS))

    async def shown() -> None:
        try:
            await lamps.show(NOTHING)
        finally:
            await lamps.end()

    with pytest.raises(InstallFailed) as refused:
        asyncio.run(shown())
    assert [problem.code for problem in refused.value.problems] == ["LAMP_MISSING"]
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]
