"""The network detector, on tiny networks that are made here.

Each sees two halves of a square image, and says that there is a thing in the left half, and one in
the right half, as surely as that half is bright.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from nondum.sdk import ConfigRefused, Header, Image
from nondum_people_detector.network import Layout, NetworkDetector

SIDE = 64
BOXES = np.array([[16, 48], [32, 32], [20, 20], [40, 40]], dtype=np.float32)
"""Rows cx, cy, width, height; a column each for the left and the right half."""


def tiny_network(path: Path, layout: Layout) -> Path:
    """Halves' brightness as the score of class 1; class 0 is never seen."""
    halves = helper.make_node(
        "AveragePool", ["image"], ["pooled"], kernel_shape=[SIDE, SIDE // 2], strides=[1, SIDE // 2]
    )
    weights = np.full((1, 3, 1, 1), 1 / 3, dtype=np.float32)
    nodes = [
        halves,
        helper.make_node("Conv", ["pooled", "mean"], ["bright"]),
        helper.make_node("Reshape", ["bright", "row"], ["scores"]),
    ]
    constants: dict[str, np.ndarray[Any, Any]] = {
        "mean": weights,
        "row": np.array([1, 1, 2], dtype=np.int64),
    }
    none = np.zeros((1, 1, 2), dtype=np.float32)
    if layout == "v8":
        parts = {"boxes": BOXES[None], "none": none}
        nodes.append(helper.make_node("Concat", ["boxes", "none", "scores"], ["out"], axis=1))
        shape = [1, 6, 2]
    else:
        parts = {"boxes": BOXES[None], "sure": none + 1, "none": none}
        order = ["boxes", "sure", "none", "scores"]
        nodes.append(helper.make_node("Concat", order, ["rows"], axis=1))
        nodes.append(helper.make_node("Transpose", ["rows"], ["out"], perm=[0, 2, 1]))
        shape = [1, 2, 7]
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, SIDE, SIDE])],
        [helper.make_tensor_value_info("out", TensorProto.FLOAT, shape)],
        [numpy_helper.from_array(array, name) for name, array in {**constants, **parts}.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))
    return path


def network(folder: Path, layout: Layout = "v8", **changed: Any) -> NetworkDetector:
    options: dict[str, Any] = {"size": SIDE, "number": 1, "threshold": 0.5, "overlap": 0.5}
    path = tiny_network(folder / "tiny.onnx", layout)
    return NetworkDetector(path, layout=layout, **{**options, **changed})


def image(left: int, right: int, side: int = 2 * SIDE) -> np.ndarray[Any, np.dtype[np.uint8]]:
    pixels = np.zeros((side, side, 3), dtype=np.uint8)
    pixels[:, : side // 2] = left
    pixels[:, side // 2 :] = right
    return pixels


@pytest.mark.parametrize("layout", ["v8", "v5"])
def test_bright_half_is_found_in_its_place(tmp_path: Path, layout: Layout) -> None:
    (found,) = network(tmp_path, layout).find(image(0, 255))
    middle = (found.left + found.width / 2, found.top + found.height / 2)
    assert middle == pytest.approx((96, 64))
    assert (found.width, found.height) == pytest.approx((40, 80))
    assert found.score == pytest.approx(1.0, abs=0.01)


def test_brighter_half_comes_first(tmp_path: Path) -> None:
    first, second = network(tmp_path).find(image(255, 180))
    assert first.left < second.left


def test_other_class_is_not_taken(tmp_path: Path) -> None:
    assert network(tmp_path, number=0).find(image(255, 255)) == ()


def test_grey_images_serve_too(tmp_path: Path) -> None:
    assert len(network(tmp_path).find(image(255, 255)[:, :, 0])) == 2


def test_wide_image_fills_a_square_with_grey(tmp_path: Path) -> None:
    """Its lower half is the filling's grey: 0.5 × 255 + 0.5 × 114 is 0.72 of full brightness."""
    found = network(tmp_path).find(image(255, 255)[:SIDE, :])
    assert [round(box.score, 2) for box in found] == [0.72, 0.72]


def test_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.onnx"
    path.write_bytes(b"no network")
    with pytest.raises(ConfigRefused, match="WEIGHTS_UNREADABLE"):
        NetworkDetector(path, size=SIDE, layout="v8", number=0, threshold=0.5, overlap=0.5)


def seen_by(bench: Any, picture: np.ndarray[Any, np.dtype[np.uint8]]) -> int:
    """How many people are seen in a picture that is fed now."""
    bench.drain("people")
    header = Header(stamp_s=1.0, frame_id="robot__cam__camera", seq=1)
    bench.feed(Image.from_array(header, picture, "bgr8"), stream="images")
    return len(bench.read("people").detections)


def test_weights_come_and_go_while_it_detects(worker: Any, tmp_path: Path) -> None:
    settings = {"weights_size": SIDE, "weights_class": 1}
    bench = worker("nondum_people_detector.plugin", settings=settings)
    call = bench.behave("detect", u="detector", i="images", o="people", h=bench.host, c="person")
    bright = image(255, 255)  # no person by their shape
    assert seen_by(bench, bright) == 0
    bench.show("weights", tiny_network(tmp_path / "tiny.onnx", "v8"))
    assert seen_by(bench, bright) == 2
    bench.hide("weights")
    assert seen_by(bench, bright) == 0
    assert call.halt().state == "halted"


def test_weights_that_are_no_network_fail_the_behaviour(worker: Any, tmp_path: Path) -> None:
    (tmp_path / "x.onnx").write_bytes(b"no network")
    bench = worker("nondum_people_detector.plugin", data={"weights": tmp_path / "x.onnx"})
    call = bench.behave("detect", u="detector", i="images", o="people", h=bench.host, c="person")
    call.assert_failed("WEIGHTS_UNREADABLE")
