"""Sound, words, numbers by name and alone, and clouds of points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from nondum.sdk.frozen import frozen
from nondum.sdk.messages.fields import Buffer, Message
from nondum.sdk.messages.header import Header

if TYPE_CHECKING:
    import numpy as np


@frozen
class Audio(Message):
    """A piece of sound, channels interleaved. Encodings: s16le, f32le (-1..1)."""

    TYPE: ClassVar[str] = "audio"
    BUFFER: ClassVar[str | None] = "data"
    SAMPLE_BYTES: ClassVar[Mapping[str, int]] = {"s16le": 2, "f32le": 4}
    header: Header
    rate_hz: int
    """Frames a second."""
    channels: int
    """Samples of one frame."""
    encoding: str
    """`s16le` or `f32le`."""
    data: Buffer
    """Whole frames, channels interleaved."""

    def faults(self) -> Iterator[str]:
        """Unknown encoding, no rate, no channels, or half a frame of samples."""
        size = self.SAMPLE_BYTES.get(self.encoding)
        if size is None:
            yield f"encoding {self.encoding!r} is none of {', '.join(self.SAMPLE_BYTES)}"
            return
        if self.rate_hz <= 0 or self.channels <= 0:
            yield f"{self.rate_hz} Hz and {self.channels} channels are not both positive"
        elif memoryview(self.data).nbytes % (size * self.channels):
            yield "the samples end within a frame"


@frozen
class Text(Message):
    """Words, said or to be said."""

    TYPE: ClassVar[str] = "text"
    header: Header
    text: str
    """The words."""
    language: str = "en"
    """BCP 47."""


@frozen
class Scalar(Message):
    """One measured number."""

    TYPE: ClassVar[str] = "scalar"
    header: Header
    value: float
    """In `unit`."""
    unit: str
    """SI symbol: `V`, `°C`, `Sv/h`; `1` where there is none."""


@frozen
class KeyValue:
    """One value by name (diagnostic_msgs/KeyValue)."""

    key: str
    """Its name, once in a message."""
    value: str
    """For people and logs. A number that others work with is a `Scalar`, which has a unit."""


@frozen
class KeyValues(Message):
    """Values by name (diagnostic_msgs/DiagnosticStatus), where no other message type fits."""

    TYPE: ClassVar[str] = "key-values"
    header: Header
    values: tuple[KeyValue, ...]
    """In the order in which people are to see them."""

    def faults(self) -> Iterator[str]:
        """A key that is empty or stands there twice."""
        keys = [value.key for value in self.values]
        if "" in keys:
            yield "a key is empty"
        if len(set(keys)) != len(keys):
            yield "a key stands there twice"


@frozen
class Points(Message):
    """A cloud of points (sensor_msgs/PointCloud2 with x, y, z): N×3 float32, metres."""

    TYPE: ClassVar[str] = "points"
    BUFFER: ClassVar[str | None] = "data"
    POINT_BYTES: ClassVar[int] = 12
    header: Header
    data: Buffer
    """x, y, z of each point, float32 little-endian, m."""

    def array(self) -> np.ndarray[Any, np.dtype[Any]]:
        """View the points as numpy array (N, 3) of float32 without copying."""
        import numpy as np

        return np.frombuffer(self.data, dtype="<f4").reshape(-1, 3)

    @classmethod
    def from_array(cls, header: Header, array: np.ndarray[Any, Any]) -> Points:
        """Make a message of an array (N, 3). Raises `ValueError` for any other shape."""
        import numpy as np

        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"points need shape (N, 3), found {array.shape}")
        return cls(header, np.ascontiguousarray(array, "<f4").reshape(-1).view(np.uint8).data)

    def faults(self) -> Iterator[str]:
        """Bytes that are not a whole number of points."""
        if memoryview(self.data).nbytes % self.POINT_BYTES:
            yield "the bytes end within a point"
