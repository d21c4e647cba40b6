"""Golden words are compared, written again, and used."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from tests.kit.golden import NAME, Golden, read, text

TESTS = Path(__file__).parents[1]
AREAS = sorted(path.relative_to(TESTS).as_posix() for path in TESTS.rglob(NAME))
SAID = {"test_lamp": {"it shines": "{lamp} shines", "it does not": 'no "light"\nin here\n'}}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    file = tmp_path / NAME
    file.write_text(text(SAID), encoding="utf-8")
    return file


def test_written_words_are_read_as_they_were(file: Path) -> None:
    assert read(file) == SAID


def test_words_are_compared_with_the_data_in_them(file: Path) -> None:
    lamp = Golden(file, "test_lamp")
    lamp.check("it shines", "spot shines", lamp="spot")
    lamp.check_line("it shines", "look:\n  spot   shines\n", lamp="spot")
    for wrong in ("spot shines!", "hall shines", "look:\nspot shines"):
        with pytest.raises(AssertionError, match="it shines"):
            lamp.check("it shines", wrong, lamp="spot")
    with pytest.raises(AssertionError, match="it shines"):
        lamp.check_line("it shines", "spot shines brightly\n", lamp="spot")


def test_situation_without_words_fails(file: Path) -> None:
    with pytest.raises(AssertionError, match="it hums"):
        Golden(file, "test_lamp").check("it hums", "")


def test_what_is_said_now_is_written(file: Path) -> None:
    writing = Golden(file, "test_lamp", is_written=True)
    writing.check("it shines", "now spot glows", lamp="spot")
    writing.check("it hums", "hm")
    writing.check_line("it shines", "lamps:\n  spot glows now\n", lamp="spot")
    assert read(file)["test_lamp"] == SAID["test_lamp"] | {
        "it shines": "{lamp} glows now",
        "it hums": "hm",
    }


@pytest.mark.parametrize("area", AREAS)
def test_every_entry_is_that_of_a_test(area: str) -> None:
    file = TESTS / area
    assert file.read_text(encoding="utf-8") == text(read(file))
    for module, said in read(file).items():
        tree = ast.parse((file.parent / f"{module}.py").read_text(encoding="utf-8"))
        named = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
        assert said.keys() <= named
