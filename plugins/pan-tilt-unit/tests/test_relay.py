"""The relay's four bytes."""

from __future__ import annotations

import pytest

from nondum_pan_tilt_unit.relay import command


@pytest.mark.parametrize(
    ("channel", "on", "expected"),
    [(1, True, "a00101a2"), (1, False, "a00100a1"), (2, True, "a00201a3")],
)
def test_commands_are_the_published_bytes(*, channel: int, on: bool, expected: str) -> None:
    assert command(channel, on=on).hex() == expected
