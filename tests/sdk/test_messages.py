"""Messages: what is sent arrives, and nothing else gets in."""

from __future__ import annotations

import contextlib
import math
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk import (
    MESSAGES,
    Audio,
    BatteryState,
    Bearing,
    BoundingBox2D,
    CameraModel,
    Depth,
    Detection,
    Detections,
    GpsFix,
    Header,
    Image,
    ImuData,
    KeyValue,
    KeyValues,
    LaserScan,
    Message,
    MessageInvalid,
    OccupancyGrid,
    Points,
    Pose,
    Scalar,
    Text,
    Twist,
)
from nondum.sdk.messages import message_from_wire, value_from_wire, value_to_wire
from nondum.sdk.wire import pack, unpack

floats = st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(st.characters(codec="utf-8"), max_size=10)
headers = st.builds(Header, floats, texts, st.integers(0, 2**40))
vectors = st.tuples(floats, floats, floats)
cameras = st.builds(
    CameraModel,
    width=st.integers(1, 9),
    height=st.integers(1, 9),
    fx=st.floats(0.1, 1e4),
    fy=st.floats(0.1, 1e4),
    cx=floats,
    cy=floats,
)
sizes = st.floats(0.1, 1e4)
boxes = st.builds(BoundingBox2D, floats, floats, sizes, sizes)
found = st.lists(st.builds(Detection, texts, st.floats(0, 1), boxes, texts), max_size=3)


@st.composite
def images(draw: st.DrawFn) -> Image:
    height, width, padding = (draw(st.integers(a, 5)) for a in (1, 1, 0))
    encoding = draw(st.sampled_from(sorted(Image.ENCODINGS)))
    step = width * Image.ENCODINGS[encoding].pixel_bytes + padding
    data = draw(st.binary(min_size=step * height, max_size=step * height))
    camera = draw(st.none() | cameras)
    return Image(draw(headers), height, width, encoding, step, data, camera)


@st.composite
def rotations(draw: st.DrawFn) -> tuple[float, ...]:
    angle = draw(st.floats(-math.pi, math.pi))
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


messages: st.SearchStrategy[Message] = st.one_of(
    images(),
    st.builds(Detections, headers, found.map(tuple), st.integers(1, 99), st.integers(1, 99)),
    st.builds(Twist, headers, vectors, vectors),
    st.builds(Pose, headers, vectors, rotations(), texts, st.none() | st.builds(Twist, headers)),
    st.builds(Bearing, headers, st.just((0.6, -0.8, 0.0)), st.floats(0, 10)),
    st.builds(Text, headers, texts, texts),
    st.builds(Scalar, headers, floats, texts),
    st.builds(Points, headers, st.binary().map(lambda data: data * 12)),
    st.builds(
        GpsFix,
        headers,
        st.floats(-90, 90),
        st.floats(-180, 180),
        st.none() | floats,
        st.none() | st.just((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 4.0)),
        st.sampled_from(GpsFix.STATUS),
    ),
    st.builds(ImuData, headers, st.none() | rotations(), st.none() | vectors, st.none() | vectors),
    st.builds(BatteryState, headers, st.floats(0, 60), st.none() | floats),
    st.builds(
        LaserScan,
        *(headers, floats, floats, st.just(0.1), st.just(30.0)),
        st.binary().map(lambda data: data * 4),
    ),
    st.builds(
        OccupancyGrid, headers, st.just(0.05), st.just(2), st.just(3), st.just(b"\0\xffd\0\0\0")
    ),
    st.builds(KeyValues, headers, st.builds(KeyValue, texts, texts).map(lambda one: (one,))),
    st.builds(Audio, headers, st.just(8000), st.just(1), st.just("s16le"), st.just(b"abcd")),
)


@given(messages.filter(lambda message: not list(message.faults())))
def test_what_is_sent_arrives(message: Message) -> None:
    message.check()
    header, buffer = message.to_wire()
    arrived = unpack(pack([header, None if buffer is None else bytes(buffer)]))
    assert message_from_wire(message.TYPE, *arrived) == message


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | floats | texts,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts, inner, max_size=3),
)


@given(messages, st.data())
def test_damaged_headers_give_a_message_or_a_refusal(message: Message, data: st.DataObject) -> None:
    header, buffer = message.to_wire()
    header[data.draw(st.sampled_from(sorted(header)))] = data.draw(plain)
    with contextlib.suppress(MessageInvalid):
        message_from_wire(message.TYPE, header, buffer)


def image_header(**changes: Any) -> dict[str, Any]:
    header, _ = Image(Header(1.0), 2, 3, "rgb8", 9, bytes(18)).to_wire()
    return {**header, **changes}


def scan_header(**changes: Any) -> dict[str, Any]:
    header, _ = LaserScan(Header(1.0), -1.5, 0.01, 0.1, 30.0, b"").to_wire()
    return {**header, **changes}


def grid_header(**changes: Any) -> dict[str, Any]:
    header, _ = OccupancyGrid(Header(1.0), 0.05, 2, 3, bytes(6)).to_wire()
    return {**header, **changes}


@pytest.mark.parametrize(
    ("kind", "header", "buffer", "told"),
    [
        ("picture", {}, None, "no message type is called 'picture'"),
        ("image", image_header(), None, "image.data: bulk bytes are missing"),
        ("image", image_header(), bytes(17), "expected 18 bytes, found 17"),
        ("image", image_header(step=8), bytes(16), "step 8 is shorter than a row of 3 pixels"),
        ("image", image_header(width=0), bytes(18), "size 0×2 is not within"),
        ("image", image_header(width=-1), bytes(18), "size -1×2 is not within"),
        ("image", image_header(height=2**40), bytes(18), "is not within"),
        ("image", image_header(width=True), bytes(18), "image.width: expected a whole number"),
        ("image", image_header(width=3.0), bytes(18), "image.width: expected a whole number"),
        ("image", image_header(encoding="h264"), bytes(18), "encoding 'h264' is none of"),
        ("image", image_header(header={}), bytes(18), ""),
        ("image", image_header(header={"stamp_s": math.inf}), bytes(18), "expected a finite"),
        ("image", image_header(header=3), bytes(18), "image.header: expected a table"),
        ("image", image_header(colour=3), bytes(18), "unknown key 'colour'"),
        ("image", image_header(camera={"fx": 1}), bytes(18), "key 'cx' is missing"),
        ("text", {"header": {}, "text": "a"}, b"x", "carries no bulk bytes"),
        ("text", {"header": {}, "text": b"a"}, None, "expected a text, found bytes"),
        ("twist", {"header": {}, "linear": [1, 2]}, None, "expected 3 values, found 2"),
        ("twist", {"header": {}, "linear": "abc"}, None, "expected a list, found str"),
        ("pose", {"header": {}, "position": [0, 0, 0], "orientation": [0, 0, 0, 0]}, None, "len"),
        ("bearing", {"header": {}, "direction": [1, 1, 0], "sigma_rad": 0}, None, "length 1"),
        ("bearing", {"header": {}, "direction": [1, 0, 0], "sigma_rad": -1}, None, "negative"),
        ("points", {"header": {}}, bytes(13), "within a point"),
        ("gps-fix", {"header": {}, "latitude_deg": 91.0, "longitude_deg": 0.0}, None, "-90..90"),
        ("gps-fix", {"header": {}, "latitude_deg": 0, "longitude_deg": 181}, None, "-180..180"),
        ("battery-state", {"header": {}, "voltage_v": 12, "fraction": 80}, None, "within 0..1"),
        ("battery-state", {"header": {}, "voltage_v": 12, "status": "ok"}, None, "none of"),
        ("imu-data", {"header": {}, "orientation": [0, 0, 0, 0]}, None, "length 1"),
        ("imu-data", {"header": {}, "angular_velocity_covariance": [-1] * 9}, None, "negative"),
        ("laser-scan", scan_header(), bytes(7), "within a range"),
        ("laser-scan", scan_header(range_min_m=40.0), bytes(8), "is not within 0..30.0"),
        ("occupancy-grid", grid_header(), bytes(5), "expected 6 bytes, found 5"),
        ("occupancy-grid", grid_header(resolution_m=0.0), bytes(6), "is not positive"),
        ("key-values", {"header": {}, "values": [{"key": "", "value": "a"}]}, None, "empty"),
        ("key-values", {"header": {}, "values": [{"key": "a", "value": "b"}] * 2}, None, "twice"),
    ],
)
def test_wrong_messages_are_refused(
    kind: str, header: dict[str, Any], buffer: bytes | None, told: str
) -> None:
    if not told:
        message_from_wire(kind, header, buffer)
        return
    with pytest.raises(MessageInvalid) as caught:
        message_from_wire(kind, header, buffer)
    assert told in str(caught.value)


def test_all_faults_are_told_at_once() -> None:
    box = BoundingBox2D(0, 0, 0, 1)
    detections = Detections(Header(), (Detection("person", 2.0, box),), 0, 0)
    with pytest.raises(MessageInvalid) as caught:
        detections.check()
    assert len(caught.value.problems) == 3


@pytest.mark.parametrize(
    ("kind", "encoding", "shape", "dtype"),
    [
        (Image, "rgb8", (2, 3, 3), "u1"),
        (Image, "mono8", (2, 3), "u1"),
        (Image, "mono16", (2, 3), "<u2"),
        (Depth, "16UC1", (2, 3), "<u2"),
        (Depth, "32FC1", (2, 3), "<f4"),
    ],
)
def test_arrays_become_images_and_back(
    kind: type[Image] | type[Depth], encoding: str, shape: tuple[int, ...], dtype: str
) -> None:
    array = np.arange(math.prod(shape), dtype=dtype).reshape(shape)
    message = kind.from_array(Header(), array, encoding)
    message.check()
    header, buffer = message.to_wire()
    arrived = kind.from_wire(header, bytes(buffer or b""))
    assert np.array_equal(arrived.array(), array)
    assert np.shares_memory(message.array(), array)


def test_rows_may_be_padded() -> None:
    image = Image(Header(), 2, 2, "mono8", 3, b"ab-cd-")
    assert image.array().tolist() == [[97, 98], [99, 100]]


@pytest.mark.parametrize(
    ("array", "encoding"),
    [
        (np.zeros((2, 2), "u1"), "rgb8"),
        (np.zeros((2, 2, 3), "f4"), "rgb8"),
        (np.zeros((2, 2, 3), "u1"), "mono8"),
        (np.zeros((2,), "u1"), "mono8"),
        (np.zeros((2, 2), "u1"), "yuv"),
    ],
)
def test_arrays_that_do_not_fit_are_a_mistake(array: Any, encoding: str) -> None:
    with pytest.raises(ValueError, match=r"encoding|needs"):
        Image.from_array(Header(), array, encoding)


def test_points_share_their_array() -> None:
    array = np.arange(6, dtype="f4").reshape(2, 3)
    points = Points.from_array(Header(), array)
    assert np.array_equal(points.array(), array)
    with pytest.raises(ValueError, match=r"shape \(N, 3\)"):
        Points.from_array(Header(), array.reshape(3, 2))


def test_scans_and_maps_share_their_arrays() -> None:
    ranges, cells = np.arange(5, dtype="f4"), np.array([[0, -1], [100, 0], [3, 4]], "i1")
    limits = {"range_min_m": 0.1, "range_max_m": 30.0}
    scan = LaserScan.from_ranges(
        Header(), ranges, angle_min_rad=-1.0, angle_increment_rad=0.5, **limits
    )
    grid = OccupancyGrid.from_array(Header(), cells, 0.05, (0.0, 0.0, 0.0))
    scan.check()
    grid.check()
    assert np.array_equal(scan.ranges(), ranges)
    assert (grid.width, grid.height) == (2, 3)
    assert np.array_equal(grid.array(), cells)
    with pytest.raises(ValueError, match="shape"):
        OccupancyGrid.from_array(Header(), cells.astype("f4"), 0.05, (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="shape"):
        LaserScan.from_ranges(
            Header(), cells, angle_min_rad=-1.0, angle_increment_rad=0.5, **limits
        )


CAMERA = CameraModel(1, 1, 1.0, 1.0, 0.0, 0.0)
FOUND = Detection("a", 1.0, BoundingBox2D(0, 0, 1, 1))
POSE = Pose(Header(), (0.0, 0.0, 0.0))
IMAGE = Image(Header(), 1, 2, "mono8", 2, b"xy")
SCALAR = Scalar(Header(), 1.0, "1")


def but(whole: Any, **changes: Any) -> Any:
    """The same with fields of whatever type: what an author writes."""
    return replace(whole, **changes)


@pytest.mark.parametrize(
    ("made", "where", "told"),
    [
        (but(POSE, position=(1.0, 2.0)), "pose.position", "expected 3 values, found 2"),
        (but(POSE, position="x"), "pose.position", "expected a tuple, found 'x'"),
        (but(POSE, position=(0, 0, "1")), "pose.position[2]", "expected a number, found '1'"),
        (but(POSE, position=(0, 0, math.nan)), "pose.position[2]", "finite number, found nan"),
        (but(POSE, header=but(Header(), stamp_s="now")), "pose.header.stamp_s", "found 'now'"),
        (but(POSE, header=None), "pose.header", "expected a Header, found NoneType"),
        (but(POSE, twist=3), "pose.twist", "expected a Twist, found int"),
        (but(Text(Header(), ""), text=b"a"), "text.text", "expected text, found bytes"),
        (but(SCALAR, value=True), "scalar.value", "expected a number, found True"),
        (but(SCALAR, value=None), "scalar.value", "found NoneType"),
        (but(IMAGE, height=1.0), "image.height", "expected a whole number, found float"),
        (but(IMAGE, data="xy"), "image.data", "expected bytes, found 'xy'"),
        (but(IMAGE, data=memoryview(b"wxyz")[::2]), "image.data", "in one piece"),
        (but(IMAGE, camera=but(CAMERA, fx="1")), "image.camera.fx", "expected a number"),
        (
            Detections(Header(), (FOUND, but(FOUND, score="x")), 1, 1),
            "detections.detections[1].score",
            "expected a number",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_wrong_fields_are_told_of_what_was_made(made: Message, where: str, told: str) -> None:
    with pytest.raises(MessageInvalid) as caught:
        made.check()
    (problem,) = caught.value.problems
    assert (problem.code, problem.where) == ("MESSAGE_FIELD", where)
    assert told in problem.message


def test_numbers_of_numpy_are_numbers() -> None:
    Twist(Header(), (np.float32(1.5), np.float64(2.0), np.int64(3))).check()  # type: ignore[arg-type]  # what authors write
    Detections(Header(), (), np.int32(4), 4).check()  # type: ignore[arg-type]  # the same


def test_pixels_are_not_looked_at() -> None:
    class Untouched(bytes):
        def __iter__(self) -> Any:
            raise AssertionError("somebody reads the pixels")

        __getitem__ = __iter__  # type: ignore[assignment]  # the same

    Image(Header(), 2, 2, "mono8", 2, Untouched(4)).check()


def test_numpy_numbers_are_written_plainly() -> None:
    twist = Twist(Header(), (np.float32(1.5), np.float64(2.0), 3))  # type: ignore[arg-type]  # what authors write
    header, _ = twist.to_wire()
    assert unpack(pack(header))["linear"] == [1.5, 2.0, 3.0]


def test_bearings_have_angles() -> None:
    bearing = Bearing.from_angles(Header(), azimuth_rad=2.0, elevation_rad=-0.5, sigma_rad=0.1)
    assert bearing.azimuth_rad == pytest.approx(2.0)
    assert bearing.elevation_rad == pytest.approx(-0.5)


def test_values_of_facts_cannot_be_bulky() -> None:
    bearing = Bearing(Header(), (1.0, 0.0, 0.0), 0.1)
    assert value_from_wire(value_to_wire(bearing)) == bearing
    with pytest.raises(MessageInvalid, match=r"\bimage\b") as refused:
        value_to_wire(Image(Header(), 1, 1, "mono8", 1, b"x"))
    assert refused.value.code == "MESSAGE_BULK"
    with pytest.raises(MessageInvalid):
        value_from_wire(["bearing"])
    with pytest.raises(MessageInvalid, match="length 1"):
        value_to_wire(Bearing(Header(), (1.0, 1.0, 0.0), 0.1))


def test_messages_that_are_none_are_not_there() -> None:
    assert not hasattr(import_module("nondum.sdk.messages"), "Picture")


def test_every_type_is_registered_under_its_own_name() -> None:
    assert all(name == kind.TYPE for name, kind in MESSAGES.items())
    assert {"image", "depth", "points", "detections", "twist", "pose"} < MESSAGES.keys()
