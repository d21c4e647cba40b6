"""A round goes on where it stopped, and stops when its time is over."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from tests.campaign.progress import Limit, Progress, Round, work_off
from tests.kit.until import PATIENCE_S

PIECES = ("one", "two", "three")


class Clock:
    """Seconds that a test counts."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def discard(_line: str) -> None:
    """Drop a line."""


def test_it_goes_on_where_it_stopped(tmp_path: Path) -> None:
    first = Round(tmp_path, PIECES, Limit(None), discard)
    first.add("one", passed=True)
    second = Round(tmp_path, PIECES, Limit(None), discard)
    assert list(second.due()) == ["two", "three"]
    assert str(second.progress) == "1 of 3"


def test_pieces_that_are_there_no_more_do_not_count(tmp_path: Path) -> None:
    first = Round(tmp_path, PIECES, Limit(None), discard)
    first.add("one", passed=False)
    first.add("two", passed=True)
    second = Round(tmp_path, ("two", "four"), Limit(None), discard)
    assert second.progress == Progress(2, ("two",), ())
    assert list(second.due()) == ["four"]


def test_nothing_begins_once_the_time_is_over(tmp_path: Path) -> None:
    clock = Clock()
    work = Round(tmp_path, PIECES, Limit(1, clock), discard)
    due = work.due()
    assert next(due) == "one"
    clock.now_s += 59.0
    assert next(due) == "two"
    clock.now_s += 1.0
    assert list(due) == []


def test_what_failed_is_told_at_the_end(tmp_path: Path) -> None:
    said: list[str] = []
    work = Round(tmp_path, PIECES, Limit(None), said.append)
    work.add("one", passed=False, note="see there")
    work.add("two", passed=True)
    assert work.end() == 1
    assert said[0].endswith("1 of 3  FAILED  one  see there")
    assert said[-2:] == ["FAILED one", "2 of 3 done, 1 failed"]
    assert Progress.read(tmp_path) == Progress(3, ("one", "two"), ("one",))


def test_a_piece_that_is_done_again_counts_once(tmp_path: Path) -> None:
    work = Round(tmp_path, PIECES, Limit(None), discard)
    work.add("one", passed=False)
    work.add("one", passed=True)
    assert work.progress == Progress(3, ("one",), ())
    assert work.end() == 0


def test_elapsed_and_left_time_are_told() -> None:
    clock = Clock()
    limit = Limit(10, clock)
    clock.now_s += 192.0
    assert str(limit) == "[3:12, 6:48 left]"
    assert str(Limit(None, clock)) == "[0:00]"


def test_pieces_are_done_once_each_and_some_at_the_same_time() -> None:
    both, done = threading.Barrier(2, timeout=PATIENCE_S), []

    def do(worker: int, piece: str) -> None:
        both.wait()
        done.append((worker, piece))

    pieces = ("one", "two", "three", "four")
    work_off(iter(pieces), 2, do)
    assert sorted(piece for _, piece in done) == sorted(pieces)
    assert {worker for worker, _ in done} == {0, 1}


@pytest.mark.parametrize("at_once", [1, 2])
def test_no_piece_is_begun_after_one_that_raised(at_once: int) -> None:
    begun: list[str] = []
    raised, ended = threading.Event(), threading.Event()

    def do(_: int, piece: str) -> None:
        begun.append(piece)
        if piece == PIECES[0]:
            raised.set()
            raise KeyboardInterrupt
        assert raised.wait(PATIENCE_S)
        assert ended.wait(PATIENCE_S)

    with pytest.raises(KeyboardInterrupt):
        work_off(iter(PIECES), at_once, do, ended.set)
    assert begun in ([PIECES[0]], [PIECES[0], PIECES[1]], [PIECES[1], PIECES[0]])
