"""The age of a campaign's result: told by git, also where git does not know enough."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.campaign import age, page
from tests.campaign.age import Changes, ages, changes_since
from tests.campaign.example import Checkout
from tests.campaign.page import Last
from tests.campaign.registry import CAMPAIGNS

COVERS = ("a", "*/pyproject.toml")


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    return Checkout(tmp_path / "checkout")


def test_commits_are_counted_and_other_paths_do_not_matter(checkout: Checkout) -> None:
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(0, ())
    checkout.write("docs/page.md", "second")
    checkout.commit()
    checkout.commit()
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(2, ())


@pytest.mark.parametrize("name", ["a/one.py", "a/new.py", "plugin/pyproject.toml"])
def test_a_committed_change_of_a_covered_path_is_seen(checkout: Checkout, name: str) -> None:
    checkout.write(name, "second")
    checkout.commit()
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(1, (name,))


@pytest.mark.parametrize("name", ["a/one.py", "a/new.py", "a/a name\twith\ntabs"])
def test_an_uncommitted_change_is_seen(checkout: Checkout, name: str) -> None:
    checkout.write(name, "second")
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(0, (name,))
    checkout.git("add", "-A")
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(0, (name,))


def test_a_deleted_file_is_a_change(checkout: Checkout) -> None:
    (checkout.root / "a/one.py").unlink()
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(0, ("a/one.py",))


def test_what_was_changed_and_put_back_is_no_change(checkout: Checkout) -> None:
    for text in ("second", "first"):
        checkout.write("a/one.py", text)
        checkout.commit()
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(2, ())


def test_what_git_ignores_is_no_change(checkout: Checkout) -> None:
    checkout.write(".gitignore", "*.pyc\n")
    checkout.write("a/one.pyc", "")
    assert changes_since(checkout.root, checkout.first, COVERS) == Changes(0, ())


def test_a_commit_that_was_rebased_away_is_not_known(checkout: Checkout) -> None:
    checkout.write("docs/page.md", "second")
    gone = checkout.commit()
    checkout.git("reset", "-q", "--hard", checkout.first)
    checkout.commit()
    assert checkout.git("cat-file", "-t", gone) == "commit", "git has it still"
    assert changes_since(checkout.root, gone, COVERS) is None


def test_a_commit_beyond_a_shallow_clone_is_not_known(checkout: Checkout, tmp_path: Path) -> None:
    last = checkout.commit()
    shallow = tmp_path / "shallow"
    checkout.git("clone", "-q", "--depth", "1", checkout.root.as_uri(), str(shallow))
    assert changes_since(shallow, checkout.first, COVERS) is None
    assert changes_since(shallow, last, COVERS) == Changes(0, ())


def test_a_folder_that_is_no_checkout_knows_nothing(tmp_path: Path) -> None:
    assert changes_since(tmp_path, "0123abc", COVERS) is None


def test_a_machine_without_git_knows_nothing(
    checkout: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(checkout.root))
    assert changes_since(checkout.root, checkout.first, COVERS) is None


def last(commit: str, passed_at: str) -> Last:
    return Last("passed", commit, "2026-01-02", 3, "2 × x86_64", "./run campaign", passed_at)


def test_the_page_of_a_checkout_says_which_results_are_current(checkout: Checkout) -> None:
    (checkout.root / page.PAGE.parent).mkdir(parents=True)
    for name, passed_at in {"faults": checkout.first, "packages": "0123abc", "fuzz": ""}.items():
        page.keep(checkout.root, name, last(passed_at, passed_at))
    found = {one.campaign: one for one in ages(checkout.root)}
    assert found.keys() == CAMPAIGNS.keys()
    assert (found["faults"].commits, found["faults"].is_current) == (0, True)
    assert (found["packages"].commits, found["packages"].is_current) == (None, False)
    assert found["packages"].why == "not known, treated as changed"
    assert (found["fuzz"].commits, found["fuzz"].why) == (None, "has never passed")
    assert age.current(checkout.root) == {"faults"}
    checkout.write("tests/faults/test_one.py", "")
    assert age.current(checkout.root) == frozenset()


def test_a_checkout_without_a_page_has_no_current_result(checkout: Checkout) -> None:
    assert age.current(checkout.root) == frozenset()
