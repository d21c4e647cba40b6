"""The quick run begins with what was changed."""

from __future__ import annotations

import pytest
from tests.runner import quick
from tests.runner.stages import ROOT


@pytest.mark.parametrize(
    ("file", "folder"),
    [
        ("host/nondum/host/mind/mind.py", "tests/host/mind"),
        ("host/nondum/host/app.py", "tests/host"),
        ("planning/nondum/planning/merge/goal.py", "tests/planning"),
        ("plugins/sdk/nondum/sdk/wire.py", "tests/sdk"),
        ("plugins/speech/nondum_speech/plugin.py", "tests/plugins"),
        ("tests/host/trust/test_chain.py", "tests/host/trust"),
        ("tests/sdk/test_wire.py", "tests/sdk"),
    ],
)
def test_file_is_tested_in_the_folder_of_its_name(file: str, folder: str) -> None:
    assert quick.tests_of(file) == folder


def test_folders_of_changed_files_come_first() -> None:
    changed = ["host/nondum/host/trust/chain.py", "wheelhouse/nondum/wheelhouse/format/lock.py"]
    first, second, *others = quick.ordered(changed)
    assert {first, second} == {"tests/host/trust", "tests/wheelhouse"}
    assert sorted([first, second, *others]) == sorted(quick.PURE)


def test_every_pure_folder_is_there() -> None:
    assert [place for place in quick.PURE if not (ROOT / place).exists()] == []
