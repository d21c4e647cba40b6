"""What is around a body: the ranges of a laser, and a map of what is free and what is not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from nondum.sdk.frozen import frozen
from nondum.sdk.messages.fields import Buffer, Message
from nondum.sdk.messages.header import Header
from nondum.sdk.messages.motion import Quaternion, Vector, is_unit

if TYPE_CHECKING:
    import numpy as np

MAX_SIDE_CELLS = 32_768


@frozen
class LaserScan(Message):
    """One sweep of a planar laser (sensor_msgs/LaserScan), in the xy plane of the header's frame.

    The stamp is that of the first ray. Rays are in order of their angle, left positive.
    """

    TYPE: ClassVar[str] = "laser-scan"
    BUFFER: ClassVar[str | None] = "data"
    RANGE_BYTES: ClassVar[int] = 4
    header: Header
    angle_min_rad: float
    """Angle of the first ray, rad."""
    angle_increment_rad: float
    """From one ray to the next, rad; negative where it turns right."""
    range_min_m: float
    """m; shorter ranges are to be left out."""
    range_max_m: float
    """m; longer ranges are to be left out: infinity is nothing within reach."""
    data: Buffer
    """Ranges, float32 little-endian, in metres; NaN: none."""
    time_increment_s: float = 0.0
    """s, from one ray to the next."""
    scan_time_s: float = 0.0
    """s, from one sweep to the next."""

    def ranges(self) -> np.ndarray[Any, np.dtype[Any]]:
        """View the ranges as numpy array of float32 without copying."""
        import numpy as np

        return np.frombuffer(self.data, dtype="<f4")

    @classmethod
    def from_ranges(
        cls,
        header: Header,
        ranges: np.ndarray[Any, Any],
        *,
        angle_min_rad: float,
        angle_increment_rad: float,
        range_min_m: float,
        range_max_m: float,
    ) -> LaserScan:
        """Make a scan of an array of ranges. Raises `ValueError` where it has not one dimension."""
        import numpy as np

        if ranges.ndim != 1:
            raise ValueError(f"ranges need shape (N,), found {ranges.shape}")
        data = np.ascontiguousarray(ranges, "<f4").view(np.uint8).data
        angles = (angle_min_rad, angle_increment_rad)
        return cls(header, *angles, range_min_m, range_max_m, data)

    def faults(self) -> Iterator[str]:
        """Limits out of order, or bytes that are not a whole number of ranges."""
        if not 0 <= self.range_min_m <= self.range_max_m:
            yield f"range_min_m {self.range_min_m} is not within 0..{self.range_max_m}"
        if memoryview(self.data).nbytes % self.RANGE_BYTES:
            yield "the bytes end within a range"


@frozen
class OccupancyGrid(Message):
    """A map of cells (nav_msgs/OccupancyGrid), in the plane of its origin's frame.

    The header's frame is that of the map (REP-105: `map`); its stamp is when the map was true.
    """

    TYPE: ClassVar[str] = "occupancy-grid"
    BUFFER: ClassVar[str | None] = "data"
    header: Header
    resolution_m: float
    """Side of a cell, m."""
    width: int
    """Cells along x."""
    height: int
    """Cells along y."""
    data: Buffer
    """One int8 a cell, row by row from the origin, x first: 0 free … 100 occupied, -1 unknown."""
    origin: Vector = (0.0, 0.0, 0.0)
    """m: where the corner of the first cell is, in the header's frame."""
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """How the map's axes are turned there."""

    def array(self) -> np.ndarray[Any, np.dtype[Any]]:
        """View the cells as numpy array (height, width) of int8 without copying."""
        import numpy as np

        return np.frombuffer(self.data, dtype="i1").reshape(self.height, self.width)

    @classmethod
    def from_array(
        cls, header: Header, array: np.ndarray[Any, Any], resolution_m: float, origin: Vector
    ) -> OccupancyGrid:
        """Make a map of an array (height, width) of int8. Raises `ValueError` for any other."""
        import numpy as np

        if array.ndim != 2 or array.dtype != np.int8:
            raise ValueError(
                f"a map needs shape (height, width) of int8, found {array.shape} of {array.dtype}"
            )
        height, width = array.shape
        data = np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
        return cls(header, resolution_m, width, height, data, origin)

    def faults(self) -> Iterator[str]:
        """Cells without size, sizes out of range, other bytes than one a cell, no rotation."""
        if self.resolution_m <= 0:
            yield f"resolution_m {self.resolution_m} is not positive"
        if not (0 < self.width <= MAX_SIDE_CELLS and 0 < self.height <= MAX_SIDE_CELLS):
            yield f"size {self.width}×{self.height} is not within 1..{MAX_SIDE_CELLS} cells"
        elif memoryview(self.data).nbytes != self.width * self.height:
            found = memoryview(self.data).nbytes
            yield f"expected {self.width * self.height} bytes, found {found}"
        if not is_unit(self.orientation):
            yield "the orientation is not a quaternion of length 1"
