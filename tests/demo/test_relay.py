"""The emulated relay latches on its own four bytes and on nothing else."""

from __future__ import annotations

from itertools import pairwise

import pytest
from demo.emulators.relay import Relay
from hypothesis import given
from hypothesis import strategies as st

ON, OFF = bytes.fromhex("a00101a2"), bytes.fromhex("a00100a1")


@pytest.mark.parametrize(
    ("sent", "closed"),
    [
        (ON, True),
        (ON + OFF, False),
        (OFF + ON, True),
        (bytes.fromhex("a00101a3"), False),
        (bytes.fromhex("a00201a3"), False),
        (b"\xff\xa0" + ON, True),
        (b"", False),
    ],
    ids=["on", "on, off", "off, on", "wrong sum", "other channel", "after noise", "nothing"],
)
def test_commands_switch(sent: bytes, *, closed: bool) -> None:
    relay = Relay()
    relay.receive(sent)
    assert relay.closed is closed


@given(st.lists(st.sampled_from((ON, OFF)), min_size=1), st.data())
def test_the_last_command_counts_however_cut(commands: list[bytes], data: st.DataObject) -> None:
    stream = b"".join(commands)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=4)))
    relay = Relay()
    for begin, end in pairwise([0, *cuts, len(stream)]):
        relay.receive(stream[begin:end])
    assert relay.closed is (commands[-1] == ON)
