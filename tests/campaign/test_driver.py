"""A campaign in a checkout: it goes on, counts for a commit or not, and keeps what failed."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.campaign import driver, page
from tests.campaign.driver import AlreadyRunning, Outcome
from tests.campaign.example import FAULTS, Checkout

ROOT = Path(__file__).parents[2]
WORK = """
import argparse, pathlib, sys
from tests.campaign.progress import Limit, Round
parser = argparse.ArgumentParser()
for option in ("--minutes", "--folder", "--keep", "--points", "--seed"):
    parser.add_argument(option)
options = parser.parse_args()
work = Round(pathlib.Path(options.folder), ["one", "two"], Limit(None))
for piece in list(work.due())[:1]:
    (pathlib.Path(options.folder) / "seed").write_text(options.seed)
    work.add(piece, passed=not pathlib.Path("tests/faults/broken").exists())
sys.exit(work.end())
"""
"""A campaign of two pieces that does one of them in each run."""
ENDLESS = """
import pathlib, sys, threading
print("begun", flush=True)
threading.Event().wait()
"""


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Checkout:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    made = Checkout(tmp_path / "checkout")
    made.write(".gitignore", "/build/\n__pycache__/\n")
    made.write("work.py", WORK)
    made.write("tests/faults/test_one.py", "")
    made.write(str(page.PAGE), page.written({}))
    made.commit()
    return made


def run(
    checkout: Checkout,
    *,
    seed: int | None = None,
    again: bool = False,
    say: Callable[[str], None] = lambda _: None,
) -> Outcome:
    return driver.run(
        checkout.root,
        FAULTS,
        1.0,
        7 if seed is None else seed,
        again=again,
        is_seed_asked=seed is not None,
        say=say,
    )


def last(checkout: Checkout) -> page.Last:
    return page.load(checkout.root)["faults"]


def test_it_goes_on_until_it_has_passed_and_counts_for_the_commit(checkout: Checkout) -> None:
    assert run(checkout).result == "1 of 2"
    assert last(checkout).passed_at == ""
    outcome = run(checkout)
    assert outcome.result == page.PASSED
    assert last(checkout).passed_at == outcome.commit == last(checkout).commit
    assert last(checkout).command == "./run campaign faults --seed 7"


def test_a_change_of_what_it_covers_begins_a_new_round(checkout: Checkout) -> None:
    run(checkout)
    checkout.write("docs/page.md", "not covered")
    checkout.commit()
    assert run(checkout).result == page.PASSED
    run(checkout)
    checkout.write("tests/faults/test_one.py", "# changed")
    checkout.commit()
    assert run(checkout).result == "1 of 2"


def test_a_changed_tree_counts_for_no_commit(checkout: Checkout) -> None:
    checkout.write("docs/page.md", "changed")
    run(checkout)
    outcome = run(checkout)
    assert outcome.result == page.PASSED
    assert outcome.commit.endswith(page.DIRTY)
    assert last(checkout).passed_at == ""


@pytest.mark.parametrize(
    ("file", "counts"), [("docs/page.md", True), ("tests/faults/test_one.py", False)]
)
def test_what_changes_meanwhile_counts_only_where_it_is_covered(
    checkout: Checkout, file: str, *, counts: bool
) -> None:
    run(checkout)

    def change(_line: str) -> None:
        checkout.write(file, "changed")
        checkout.commit()

    begun_at = checkout.git("rev-parse", "--short=10", "HEAD")
    outcome = run(checkout, say=change)
    assert outcome.commit == (begun_at if counts else begun_at + page.DIRTY)
    assert last(checkout).passed_at == (begun_at if counts else "")


def test_once_it_is_committed_what_was_done_before_counts(checkout: Checkout) -> None:
    checkout.write("tests/faults/test_one.py", "# changed")
    run(checkout)
    run(checkout)
    checkout.commit()
    outcome = run(checkout)
    assert (outcome.result, last(checkout).passed_at) == (page.PASSED, outcome.commit)


def test_a_failure_is_named_and_its_folder_stays(checkout: Checkout) -> None:
    checkout.write("tests/faults/broken", "")
    outcome = run(checkout)
    assert (outcome.result, outcome.failed) == (page.FAILED, ("one",))
    assert (Path(outcome.evidence) / "seed").read_text() == "7"
    (checkout.root / "tests/faults/broken").unlink()
    assert run(checkout).result == "1 of 2"
    (kept,) = (checkout.root / driver.FOLDER / "faults").glob("failed-*")
    assert (kept / "seed").exists()


def test_what_passed_before_stays_known_when_it_fails(checkout: Checkout) -> None:
    run(checkout)
    passed_at = run(checkout).commit
    checkout.write("tests/faults/broken", "")
    checkout.commit()
    assert run(checkout).result == page.FAILED
    assert last(checkout).passed_at == passed_at


def test_a_round_keeps_its_seed_unless_another_is_asked_for(checkout: Checkout) -> None:
    assert run(checkout, seed=3).seed == 3
    assert run(checkout).seed == 3
    outcome = run(checkout, seed=4)
    assert (outcome.seed, outcome.result) == (4, "1 of 2")


def test_again_begins_again(checkout: Checkout) -> None:
    run(checkout)
    assert run(checkout, again=True).result == "1 of 2"


def test_a_command_that_ends_with_an_error_has_failed(checkout: Checkout) -> None:
    checkout.write("work.py", "raise SystemExit('no')")
    outcome = run(checkout)
    assert outcome.result == page.FAILED
    assert (checkout.root / driver.FOLDER / "faults/log").read_text() == "no\n"


DRIVE = """
import pathlib, signal, sys
from tests.campaign.example import FAULTS
from tests.campaign import driver
signal.signal(signal.SIGINT, signal.default_int_handler)
root = pathlib.Path(sys.argv[1])
print(driver.run(root, FAULTS, 1.0, 7, say=lambda line: print(line, flush=True)), flush=True)
"""


def test_ctrl_c_keeps_what_was_done_and_only_one_runs_at_a_time(checkout: Checkout) -> None:
    run(checkout)
    checkout.write("work.py", ENDLESS)
    checkout.commit()
    command = [sys.executable, "-c", DRIVE, str(checkout.root)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        with pytest.raises(AlreadyRunning):
            run(checkout)
        process.send_signal(signal.SIGINT)
        said = process.stdout.read()
    assert "was_interrupted=True" in said
    assert last(checkout).result == "1 of 2"
