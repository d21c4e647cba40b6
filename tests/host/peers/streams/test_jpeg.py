"""A JPEG becomes what its header says, or is refused."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import PIL.Image
import pytest

from nondum.host.peers.streams import jpeg
from nondum.sdk.errors import MessageInvalid

HEADER = {"encoding": "rgb8", "width": 6, "height": 4, "step": 18}


def picture(width: int = 6, height: int = 4, mode: str = "RGB", form: str = "JPEG") -> bytes:
    out = BytesIO()
    PIL.Image.new(mode, (width, height)).save(out, form)
    return out.getvalue()


def test_sound_picture_has_the_bytes_that_its_header_declares() -> None:
    assert jpeg.restored(HEADER, picture()) == bytes(6 * 4 * 3)
    assert jpeg.restored({**HEADER, "encoding": "mono8"}, picture(mode="L")) == bytes(6 * 4)


@pytest.mark.parametrize(
    ("header", "data"),
    [
        ({"encoding": "mono16"}, picture()),
        ({"encoding": 8}, picture()),
        ({"width": "6"}, picture()),
        ({"height": None}, picture()),
        ({"width": 0}, picture()),
        ({"width": -6}, picture()),
        ({}, picture(width=4, height=6)),
        ({}, picture(mode="L")),
        ({"encoding": "mono8"}, picture()),
        ({}, picture(form="PNG")),
        ({}, picture()[:-40]),
        ({}, b""),
    ],
    ids=[
        *("sixteen bits", "encoding", "width", "height", "no width", "negative", "turned"),
        *("grey", "colours", "png", "cut short", "nothing"),
    ],
)
def test_other_picture_than_its_header_says_is_refused(header: dict[str, Any], data: bytes) -> None:
    with pytest.raises(MessageInvalid, match="JPEG_INVALID"):
        jpeg.restored({**HEADER, **header}, data)


def test_picture_beyond_a_frame_is_not_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jpeg, "MAX_BULK", 6 * 4 * 3)
    assert jpeg.restored(HEADER, picture())
    monkeypatch.setattr(jpeg, "MAX_BULK", 6 * 4 * 3 - 1)
    with pytest.raises(MessageInvalid, match="too many"):
        jpeg.restored(HEADER, picture())


@pytest.mark.parametrize("width", [0, -6])
def test_picture_of_no_pixels_is_refused_by_its_size(width: int) -> None:
    with pytest.raises(MessageInvalid, match="too many"):
        jpeg.restored({**HEADER, "width": width}, picture())
