"""The estimator on the bench, with a tiny network that takes brightness for distance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from nondum.sdk import CameraModel, Depth, Header, Image, WorkerFailed

PLUGIN = "nondum_depth_estimator.plugin"
SIDE = 32
SETTINGS = {"width": SIDE, "height": SIDE, "colours": "unit", "scale": 10.0}
CAMERA = CameraModel(128, 64, 100.0, 100.0, 64.0, 32.0)


def tiny_network(path: Path, factor: float = 1.0, channels: int = 1) -> Path:
    """The brightness of each 2 × 2 pixels, 0..1, times a factor; several times over."""
    pool = helper.make_node(
        "AveragePool", ["image"], ["pooled"], kernel_shape=[2, 2], strides=[2, 2]
    )
    mean = np.full((channels, 3, 1, 1), factor / 3, dtype=np.float32)
    graph = helper.make_graph(
        [pool, helper.make_node("Conv", ["pooled", "mean"], ["depth"])],
        "tiny",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 3, SIDE, SIDE])],
        [
            helper.make_tensor_value_info(
                "depth", TensorProto.FLOAT, [1, channels, SIDE // 2, SIDE // 2]
            )
        ],
        [numpy_helper.from_array(mean, "mean")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))
    return path


def image(left: int, right: int, encoding: str = "bgr8") -> Image:
    """Two halves, each of one brightness, 0..255."""
    shape = (64, 128, 3) if encoding in ("bgr8", "rgb8") else (64, 128)
    array = np.zeros(shape, dtype=np.uint16 if encoding == "mono16" else np.uint8)
    factor = 257 if encoding == "mono16" else 1
    array[:, :64], array[:, 64:] = left * factor, right * factor
    header = Header(stamp_s=12.5, frame_id="robot__cam__camera", seq=7)
    return Image.from_array(header, array, encoding, CAMERA)


def begin(worker: Any, weights: Path, **settings: Any) -> tuple[Any, Any]:
    bench = worker(PLUGIN, settings={**SETTINGS, **settings}, data={"weights": weights})
    return bench, bench.behave("estimate", u="estimator", i="images", o="depth", h=bench.host)


def seen(bench: Any, picture: Image) -> Depth:
    bench.drain("depth")
    bench.feed(picture, stream="images")
    return bench.read("depth")  # type: ignore[no-any-return]  # of whatever type the slot is


def halves(depth: Depth) -> tuple[float, float]:
    array = depth.array()
    return float(array[:, 1].mean()), float(array[:, -2].mean())


@pytest.mark.parametrize("encoding", ["bgr8", "rgb8", "mono8", "mono16"])
def test_distances_are_metres_in_their_place(worker: Any, tmp_path: Path, encoding: str) -> None:
    bench, call = begin(worker, tiny_network(tmp_path / "tiny.onnx"))
    depth = seen(bench, image(51, 204, encoding))
    assert halves(depth) == pytest.approx((2.0, 8.0), rel=0.01)
    call.wait_established()
    assert call.halt().state == "halted"


def test_depth_has_the_stamp_frame_and_camera_of_its_image(worker: Any, tmp_path: Path) -> None:
    bench, _ = begin(worker, tiny_network(tmp_path / "tiny.onnx"))
    picture = image(100, 100)
    depth = seen(bench, picture)
    assert (depth.header, depth.width, depth.height) == (picture.header, 16, 16)
    assert depth.camera == CameraModel(16, 16, 12.5, 25.0, 8.0, 8.0)


def test_inverse_answers_are_turned_into_metres(worker: Any, tmp_path: Path) -> None:
    """2.5 and 10 of 10 · brightness, and so 1 ÷ (0.2 · answer)."""
    weights = tiny_network(tmp_path / "tiny.onnx", factor=10)
    bench, _ = begin(worker, weights, output="inverse", scale=0.2)
    assert halves(seen(bench, image(64, 255))) == pytest.approx((2.0, 0.5), rel=0.02)


def test_what_is_too_far_or_behind_is_not_known(worker: Any, tmp_path: Path) -> None:
    bench, _ = begin(worker, tiny_network(tmp_path / "tiny.onnx"), furthest_m=5.0)
    near, far = halves(seen(bench, image(51, 204)))
    assert near == pytest.approx(2.0, rel=0.01)
    assert np.isnan(far)
    assert np.isnan(halves(seen(bench, image(0, 0)))[0])


def test_other_weights_are_used_from_the_next_image_on(worker: Any, tmp_path: Path) -> None:
    bench, _ = begin(worker, tiny_network(tmp_path / "one.onnx"))
    assert halves(seen(bench, image(51, 51)))[0] == pytest.approx(2.0, rel=0.01)
    bench.show("weights", tiny_network(tmp_path / "two.onnx", factor=2))
    assert halves(seen(bench, image(51, 51)))[0] == pytest.approx(4.0, rel=0.01)


def test_without_weights_it_does_not_begin(worker: Any) -> None:
    bench = worker(PLUGIN)
    call = bench.behave("estimate", u="estimator", i="images", o="depth", h=bench.host)
    call.assert_failed("DATA_MISSING")


@pytest.mark.parametrize("wrong", ["no network", "two numbers for each pixel"])
def test_weights_that_do_not_serve_are_told(worker: Any, tmp_path: Path, wrong: str) -> None:
    weights = tmp_path / "x.onnx"
    if wrong == "no network":
        weights.write_bytes(b"no network")
    else:
        tiny_network(weights, channels=2)
    bench, call = begin(worker, weights)
    bench.feed(image(1, 1), stream="images")
    call.assert_failed("WEIGHTS_UNREADABLE")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"width": 8}, "at least 32"),
        ({"scale": 0.0}, "scale must not be 0"),
        ({"output": "feet"}, "one of 'metres', 'inverse'"),
    ],
    ids=["width", "scale", "output"],
)
def test_wrong_settings_refuse_the_component(
    worker: Any, settings: dict[str, object], words: str
) -> None:
    with pytest.raises(WorkerFailed, match=words):
        worker(PLUGIN, settings=settings)
