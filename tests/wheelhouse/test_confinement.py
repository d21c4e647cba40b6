"""Levels of confinement: by name, by number, and which confines more."""

from __future__ import annotations

import itertools

import pytest

from nondum.wheelhouse.format.confinement import Level, parse


def test_levels_are_ordered_by_how_much_they_confine() -> None:
    assert sorted(Level, reverse=True) == [Level.SANDBOXED, Level.RESTRICTED, Level.NONE]
    for lower, higher in itertools.pairwise(Level):
        assert lower < higher and higher > lower and lower <= lower and not higher <= lower


@pytest.mark.parametrize("level", Level, ids=str)
def test_a_level_is_read_as_it_is_written(level: Level) -> None:
    assert parse(str(level)) is level


@pytest.mark.parametrize(
    ("number", "level"),
    [
        pytest.param(0, Level.NONE, id="0"),
        pytest.param(1, Level.RESTRICTED, id="1"),
        pytest.param(2, Level.SANDBOXED, id="2"),
        pytest.param(3, Level.SANDBOXED, id="3"),
    ],
)
def test_a_level_is_read_by_number_too(number: int, level: Level) -> None:
    assert parse(number) is level
    assert parse(str(number)) is level


@pytest.mark.parametrize(
    "value",
    [
        pytest.param(4, id="above"),
        pytest.param(-1, id="below"),
        pytest.param(16**5000, id="huge"),
        pytest.param("4", id="above as text"),
        pytest.param("03", id="another text of a number"),
        pytest.param("SANDBOXED", id="capitals"),
        pytest.param("auto", id="what only a host may want"),
        pytest.param("", id="nothing"),
        pytest.param(True, id="true"),
        pytest.param(1.0, id="float"),
        pytest.param(None, id="null"),
        pytest.param(["none"], id="list"),
    ],
)
def test_anything_else_is_no_level(value: object) -> None:
    with pytest.raises(ValueError, match="expected"):
        parse(value)
