"""Camera images and depth images (sensor_msgs/Image, sensor_msgs/CameraInfo)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

from nondum.sdk.frozen import frozen
from nondum.sdk.messages.fields import Buffer, Message
from nondum.sdk.messages.header import Header

if TYPE_CHECKING:
    import numpy as np

MAX_SIDE_PX = 32_768


@frozen
class CameraModel:
    """A pinhole camera without distortion; all in pixels (sensor_msgs/CameraInfo's K).

    x to the right and y down in the image, the optical axis through (cx, cy).
    """

    width: int
    """px"""
    height: int
    """px"""
    fx: float
    """Focal length along x, px."""
    fy: float
    """Focal length along y, px."""
    cx: float
    """x of the optical axis, px."""
    cy: float
    """y of the optical axis, px."""


@frozen
class _Encoding:
    dtype: str
    channels: int

    @property
    def pixel_bytes(self) -> int:
        return int(self.dtype[-1]) * self.channels


class _Raster(Message):
    """Rows of pixels in one buffer."""

    __slots__ = ()
    BUFFER: ClassVar[str | None] = "data"
    ENCODINGS: ClassVar[Mapping[str, _Encoding]]

    if TYPE_CHECKING:  # the fields of both messages, for the methods below
        header: Header
        height: int
        width: int
        encoding: str
        step: int
        data: Buffer
        camera: CameraModel | None

    def array(self) -> np.ndarray[Any, np.dtype[Any]]:
        """View the pixels as numpy array (height, width[, channels]) without copying."""
        import numpy as np

        encoding = self.ENCODINGS[self.encoding]
        dtype = np.dtype(encoding.dtype)
        shape: tuple[int, ...] = (self.height, self.width)
        strides: tuple[int, ...] = (self.step, encoding.pixel_bytes)
        if encoding.channels > 1:
            shape, strides = (*shape, encoding.channels), (*strides, dtype.itemsize)
        return np.ndarray(shape, dtype, buffer=self.data, strides=strides)

    @classmethod
    def from_array(
        cls,
        header: Header,
        array: np.ndarray[Any, Any],
        encoding: str,
        camera: CameraModel | None = None,
    ) -> Self:
        """Make a message of an array (height, width[, channels]); it shares the array's memory.

        Raises `ValueError` where array and encoding do not fit.
        """
        import numpy as np

        known = cls.ENCODINGS.get(encoding)
        if known is None:
            raise ValueError(f"{cls.TYPE} encodings: {', '.join(cls.ENCODINGS)}; not {encoding!r}")
        channels = array.shape[2] if array.ndim == 3 else 1
        if array.ndim not in (2, 3) or channels != known.channels or array.dtype != known.dtype:
            raise ValueError(
                f"{encoding} needs {known.channels} channel(s) of {known.dtype}, "
                f"found shape {array.shape} of {array.dtype}"
            )
        pixels = np.ascontiguousarray(array)
        return cls(  # type: ignore[call-arg]  # the fields are the subclasses'
            header=header,
            height=array.shape[0],
            width=array.shape[1],
            encoding=encoding,
            step=array.shape[1] * known.pixel_bytes,
            data=pixels.reshape(-1).view(np.uint8).data,
            camera=camera,
        )

    def faults(self) -> Iterator[str]:
        """Unknown encoding, sizes out of range, or too few bytes for the rows."""
        known = self.ENCODINGS.get(self.encoding)
        if known is None:
            yield f"encoding {self.encoding!r} is none of {', '.join(self.ENCODINGS)}"
            return
        if not (0 < self.width <= MAX_SIDE_PX and 0 < self.height <= MAX_SIDE_PX):
            yield f"size {self.width}×{self.height} is not within 1..{MAX_SIDE_PX} pixels"
            return
        if self.step < self.width * known.pixel_bytes:
            yield f"step {self.step} is shorter than a row of {self.width} pixels"
        if memoryview(self.data).nbytes != self.step * self.height:
            yield f"expected {self.step * self.height} bytes, found {memoryview(self.data).nbytes}"
        if self.camera is not None and (self.camera.fx <= 0 or self.camera.fy <= 0):
            yield "the camera's focal lengths are not positive"


@frozen
class Image(_Raster):
    """An image of a camera. Encodings: rgb8, bgr8, mono8, mono16 (little-endian)."""

    TYPE: ClassVar[str] = "image"
    ENCODINGS: ClassVar[Mapping[str, _Encoding]] = {
        "rgb8": _Encoding("|u1", 3),
        "bgr8": _Encoding("|u1", 3),
        "mono8": _Encoding("|u1", 1),
        "mono16": _Encoding("<u2", 1),
    }
    header: Header
    height: int
    """px, 1..32768."""
    width: int
    """px, 1..32768."""
    encoding: str
    """`rgb8`, `bgr8`, `mono8` or `mono16` (little-endian)."""
    step: int
    """Bytes from one row to the next."""
    data: Buffer
    """`step` × `height` bytes, rows from the top."""
    camera: CameraModel | None = None
    """How pixels are directions; None where that is not known."""


@frozen
class Depth(_Raster):
    """Distances along the optical axis. 16UC1: millimetres; 32FC1: metres. 0 or NaN: none."""

    TYPE: ClassVar[str] = "depth"
    ENCODINGS: ClassVar[Mapping[str, _Encoding]] = {
        "16UC1": _Encoding("<u2", 1),
        "32FC1": _Encoding("<f4", 1),
    }
    header: Header
    height: int
    """px, 1..32768."""
    width: int
    """px, 1..32768."""
    encoding: str
    """`16UC1` (millimetres) or `32FC1` (metres), little-endian."""
    step: int
    """Bytes from one row to the next."""
    data: Buffer
    """`step` × `height` bytes, rows from the top."""
    camera: CameraModel | None = None
    """How pixels are directions; None where that is not known."""
