"""A process that looks around leaves nothing behind."""

from __future__ import annotations

from pathlib import Path

from nondum.host.sandbox.inside import inspect_self


def test_trying_to_write_leaves_no_file(tmp_path: Path) -> None:
    assert inspect_self._can_write(str(tmp_path))
    assert not list(tmp_path.iterdir())
