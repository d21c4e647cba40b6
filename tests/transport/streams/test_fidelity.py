"""Images are compressed while a link cannot carry them, and are not for ever."""

from __future__ import annotations

from nondum.transport.streams import Coding, Fidelity
from nondum.transport.streams.fidelity import MOST_PATIENCE_S, PATIENCE_S

RATE_HZ = 30


class Camera:
    """Images at 30 Hz, over a link that carries raw ones, or does not."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.fidelity = Fidelity(self.now_s)

    def runs(self, seconds: float, *, carries_raw: bool, carries_jpeg: bool = True) -> None:
        for _ in range(round(seconds * RATE_HZ)):
            self.now_s += 1 / RATE_HZ
            is_raw = self.fidelity.coding is Coding.RAW
            if carries_raw if is_raw else carries_jpeg:
                self.fidelity.sent(self.now_s)
            else:
                self.fidelity.dropped(self.now_s)

    def raw_again_after(self, *, carries_raw: bool) -> float:
        """How long it goes on with JPEG."""
        begun_s = self.now_s
        while self.fidelity.coding is Coding.JPEG:
            self.runs(1 / RATE_HZ, carries_raw=carries_raw)
        return self.now_s - begun_s


def test_images_stay_raw_where_they_fit() -> None:
    camera = Camera()
    camera.runs(60, carries_raw=True)
    assert camera.fidelity.coding is Coding.RAW


def test_images_that_do_not_fit_are_compressed_soon() -> None:
    camera = Camera()
    camera.runs(1.5, carries_raw=False)
    assert camera.fidelity.coding is Coding.JPEG


def test_few_lost_images_are_no_reason() -> None:
    camera = Camera()
    for second in range(30):
        camera.runs(0.9, carries_raw=True)
        camera.runs(0.1, carries_raw=second % 2 == 0)
    assert camera.fidelity.coding is Coding.RAW


def test_slow_camera_is_judged_late_but_judged() -> None:
    camera = Camera()
    for _ in range(10):
        camera.now_s += 2.0
        camera.fidelity.dropped(camera.now_s)
    assert camera.fidelity.coding is Coding.JPEG


def test_raw_is_tried_again_after_a_calm_time() -> None:
    camera = Camera()
    camera.runs(1.5, carries_raw=False)
    assert PATIENCE_S <= camera.raw_again_after(carries_raw=True) + 1.5 <= PATIENCE_S + 3
    camera.runs(60, carries_raw=True)
    assert camera.fidelity.coding is Coding.RAW


def test_trials_that_fail_become_rare() -> None:
    camera = Camera()
    camera.runs(1.5, carries_raw=False)
    waits = []
    for _ in range(7):
        waits.append(camera.raw_again_after(carries_raw=False))
        camera.runs(1.5, carries_raw=False)
        assert camera.fidelity.coding is Coding.JPEG
    assert waits == sorted(waits)
    assert waits[2] > 3 * waits[0]
    assert waits[-1] <= MOST_PATIENCE_S + 2


def test_link_that_held_raw_for_long_is_soon_tried_again() -> None:
    camera = Camera()
    for _ in range(4):
        camera.runs(1.5, carries_raw=False)
        camera.raw_again_after(carries_raw=False)
    camera.runs(120, carries_raw=True)
    camera.runs(2.5, carries_raw=False)
    assert camera.fidelity.coding is Coding.JPEG
    assert camera.raw_again_after(carries_raw=True) <= PATIENCE_S + 3


def test_raw_is_not_tried_where_even_jpeg_is_lost() -> None:
    camera = Camera()
    camera.runs(1.5, carries_raw=False)
    camera.runs(60, carries_raw=False, carries_jpeg=False)
    assert camera.fidelity.coding is Coding.JPEG
