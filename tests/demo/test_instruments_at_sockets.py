"""The same emulators behind serial adapters of an emulated machine: they speak at sockets."""

from __future__ import annotations

import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from demo.instruments import Instruments, switched_on
from demo.scenario import random_scenario

from nondum_compton_camera.listmode import Decoder, Event, Status

SOON_S = 60.0


@pytest.fixture
def instruments() -> Iterator[Instruments]:
    with (
        tempfile.TemporaryDirectory() as folder,  # the path of a socket must be short
        switched_on(random_scenario(1), Path(folder), sockets=True) as switched,
    ):
        yield switched


def plugged(path: str) -> socket.socket:
    line = socket.socket(socket.AF_UNIX)
    line.settimeout(SOON_S)
    line.connect(path)
    return line


def test_camera_tells_what_it_sees(instruments: Instruments) -> None:
    decoder, heard = Decoder(), list[Event | Status]()
    with plugged(instruments.nodes["camera"]) as line:
        while not heard:
            heard += decoder.feed(line.recv(4096))


def test_unit_answers_and_its_laser_is_switched(instruments: Instruments) -> None:
    with plugged(instruments.nodes["head"]) as head, plugged(instruments.nodes["relay"]) as relay:
        said = b""
        head.sendall(b"V ")
        while b"*" not in said:
            said += head.recv(4096)
        relay.sendall(b"\xa0\x01\x01\xa2")
        while '"laser": true' not in instruments.log.read_text(encoding="utf-8"):
            head.sendall(b"PP ")
            assert head.recv(4096)
