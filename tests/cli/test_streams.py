"""Messages as people and machines see them: small fields whole, bulk by its length."""

from __future__ import annotations

from nondum.cli.streams import message_line, message_row
from nondum.sdk import BoundingBox2D, Detection, Detections, Header, Image, Text

HEADER = Header(stamp_s=12.5, frame_id="spot__eye__camera", seq=7)


def test_an_image_is_its_fields_and_a_length() -> None:
    row = message_row(Image(HEADER, 2, 3, "rgb8", 9, b"\x00" * 18, None), 9)
    assert (row["type"], row["bytes"], row["seq"], row["number"]) == ("image", 18, 7, 9)
    assert "data" not in row["fields"]
    shown = message_line(row)
    assert shown.startswith("12.500000  spot__eye__camera  #9  height=2 width=3 encoding=rgb8")
    assert shown.endswith("18 B")


def test_many_items_are_counted() -> None:
    box = BoundingBox2D(10.0, 20.0, 4.0, 8.0)
    found = tuple(Detection("person", 0.9, box, id=str(i)) for i in range(30))
    shown = message_line(message_row(Detections(HEADER, found, 640, 480, None), 1))
    assert "detections=30 items" in shown
    assert len(shown) < 200


def test_words_of_a_stream_cannot_drive_a_terminal() -> None:
    shown = message_line(message_row(Text(HEADER, "hello\x1b[2J" + "o" * 100), 1))
    assert "hello\\x1b[2Jooo" in shown
    assert "\x1b" not in shown
    assert "…" in shown
