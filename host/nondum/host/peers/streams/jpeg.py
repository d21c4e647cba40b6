"""Images to JPEG and back to the very pixel format that they had. Source: ITU-T T.81, by Pillow.

Depth is never compressed: a distance between near and far is neither.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Any

from nondum.sdk.errors import MessageInvalid, Problem
from nondum.sdk.messages import Buffer, Image
from nondum.transport.streams.packets import MAX_BULK

QUALITY = 85

_MODES = {"rgb8": ("RGB", "RGB", 3), "bgr8": ("RGB", "BGR", 3), "mono8": ("L", "L", 1)}
"""By encoding: Pillow's mode, its raw mode, and the bytes of a pixel."""


def is_compressible(encoding: str) -> bool:
    """Whether images of an encoding can be had as JPEG: 16 bits cannot.

    >>> is_compressible("bgr8"), is_compressible("mono16")
    (True, False)
    """
    return encoding in _MODES


def compressed(image: Image) -> tuple[dict[str, Any], bytes]:
    """An image's header, for rows without padding, and its pixels as JPEG. Takes milliseconds."""
    import PIL.Image

    mode, raw, pixel_bytes = _MODES[image.encoding]
    size = (image.width, image.height)
    pixels: Any = image.data  # Pillow takes any buffer, and says bytes
    picture = PIL.Image.frombuffer(mode, size, pixels, "raw", raw, image.step, 1)
    out = BytesIO()
    picture.save(out, "JPEG", quality=QUALITY)
    header, _ = image.to_wire()
    return {**header, "step": image.width * pixel_bytes}, out.getvalue()


def restored(header: Mapping[str, Any], data: Buffer) -> bytes:
    """The pixels of an image as its header says. Takes milliseconds.

    Raises `MessageInvalid` (JPEG_INVALID) for what is no such picture; nothing is unpacked that is
    larger than a frame may be.
    """
    import PIL.Image

    match header:
        case {"encoding": str(encoding), "width": int(width), "height": int(height)} if (
            encoding in _MODES
        ):
            mode, raw, pixel_bytes = _MODES[encoding]
        case _:
            raise _invalid("a JPEG comes with encoding, width and height of an image of 8 bits")
    if not 0 < width * height * pixel_bytes <= MAX_BULK:
        raise _invalid(f"{width}×{height} pixels are too many")
    try:
        with PIL.Image.open(BytesIO(data), formats=["JPEG"]) as picture:
            if picture.size != (width, height) or picture.mode != mode:
                raise _invalid(
                    f"a picture of {picture.size} in {picture.mode}, not of {width}×{height} {mode}"
                )
            return picture.tobytes("raw", raw)
    except MessageInvalid:
        raise
    except Exception as error:  # a stranger's picture may have Pillow raise anything
        raise _invalid(f"{type(error).__name__}: {error}"[:200]) from error


def _invalid(message: str) -> MessageInvalid:
    return MessageInvalid(Problem("JPEG_INVALID", message))
