"""The page of unstable tests, and what comes onto it."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from tests.runner import full, job, stages, unstable
from tests.runner.unstable import Entry

WORDS = st.text("abc |[]-:/_.", min_size=1).map(lambda text: f"t{text}t")
ENTRIES = st.lists(st.builds(Entry, WORDS, st.just("2026-01-02"), st.just("abc1234"), WORDS))


@given(ENTRIES)
def test_what_is_written_is_read(entries: list[Entry]) -> None:
    assert list(unstable.read(unstable.written(entries))) == entries


def test_entries_are_added_below_and_once(tmp_path: Path) -> None:
    page, first, second = tmp_path / "p.md", Entry("a", "d", "c"), Entry("b", "d", "c")
    unstable.add(page, [first])
    unstable.add(page, [first, second])
    assert unstable.read(page.read_text()) == (first, second)


def test_page_of_the_checkout_is_readable() -> None:
    rows = [row for row in unstable.PAGE.read_text().splitlines() if row.startswith("| `")]
    assert len(unstable.read(unstable.PAGE.read_text())) == len(rows)


TESTS = """
from pathlib import Path

def test_fails_the_first_time():
    marker = Path(__file__).with_name("ran")
    ran_before = marker.exists()
    marker.touch()
    assert ran_before

def test_fails_always(tmp_path):
    (tmp_path / "evidence").touch()
    assert False

def test_passes():
    pass
"""


def test_only_what_passes_alone_is_unstable(tmp_path: Path) -> None:
    folder, run = tmp_path / "checkout", tmp_path / "run"
    folder.mkdir()
    run.mkdir()
    (folder / "test_it.py").write_text(TESTS)
    done = job.run(stages.pytest_job("first", run, ("-c", "/dev/null", "."), folder=folder))
    outcomes = {one.test.split("::")[1]: one.outcome for one in done.results}
    assert outcomes == {
        "test_fails_the_first_time": "failed",
        "test_fails_always": "failed",
        "test_passes": "passed",
    }
    assert not done.failed_itself
    (unstable_one,) = full.passed_alone([done], run)
    assert unstable_one.test.endswith("::test_fails_the_first_time")
