"""Points are counted by their names, so that each needs one of its own."""

from __future__ import annotations

from tests.faults.points import boundaries


def test_rows_of_both_tables_have_names_of_their_own() -> None:
    names = [point.name for point in boundaries(times=2)]
    assert sorted(set(names)) == sorted(names)
