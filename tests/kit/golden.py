"""The words of an area, each asserted in one place: `words.golden.toml`, a plugin of pytest.

A test names a situation; the file beside the tests of the area says what people read or hear in it.
With `--write-golden` the tests that are run write down what is said now, instead of failing.
"""

from __future__ import annotations

import difflib
import fcntl
import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import pytest

NAME = "words.golden.toml"

Words = dict[str, dict[str, str]]
"""Situation to sentence, in a table for each module of tests."""


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("nondum")
    group.addoption("--write-golden", action="store_true", help=f"write {NAME} again")


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """The words of the area that the test belongs to."""
    folder = next(parent for parent in request.path.parents if (parent / NAME).is_file())
    module = request.path.relative_to(folder).with_suffix("").as_posix()
    return Golden(folder / NAME, module, is_written=request.config.getoption("--write-golden"))


@dataclass(frozen=True)
class Golden:
    """What is said in the situations that one module of tests brings about."""

    file: Path
    module: str
    is_written: bool = False

    def check(self, situation: str, said: str, **data: object) -> None:
        """Assert what is said, but for the end of its last line.

        `{name}` in the file stands for what `data` has under that name.
        """
        said = said.removesuffix("\n")
        if self.is_written:
            self._write(situation, said, data)
        assert said == self._words(situation, data), f"{situation}: {self.file}"

    def check_line(self, situation: str, shown: str, **data: object) -> None:
        """Assert one line of what is shown, its white space folded."""
        lines = [" ".join(line.split()) for line in shown.splitlines()]
        if self.is_written and self._words(situation, data) not in lines:
            [closest] = difflib.get_close_matches(self._words(situation, data), lines, 1, 0.0)
            self._write(situation, closest, data)
        assert self._words(situation, data) in lines, f"{situation}: {self.file}"

    def _words(self, situation: str, data: dict[str, object]) -> str:
        words = read(self.file).get(self.module, {}).get(situation)
        assert words is not None, f"{self.file} has no [{self.module}] {situation!r}"
        for name, value in data.items():
            words = words.replace(f"{{{name}}}", str(value))
        return words

    def _write(self, situation: str, said: str, data: dict[str, object]) -> None:
        for name, value in sorted(data.items(), key=lambda item: -len(str(item[1]))):
            said = said.replace(str(value), f"{{{name}}}")
        with self.file.open("r+", encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_EX)  # tests run in several processes
            words = tomllib.loads(file.read())
            words.setdefault(self.module, {})[situation] = said
            file.seek(0)
            file.truncate()
            file.write(text(words))


def read(file: Path) -> Words:
    """All words of an area."""
    words: Words = tomllib.loads(file.read_text(encoding="utf-8"))
    return words


def text(words: Words) -> str:
    """The words as a file of TOML, in the order in which they came.

    >>> print(text({"test_lamp": {"it is dark": 'say "light"'}}), end="")
    # What people read and hear: situation = words. Written again by `pytest --write-golden`.
    <BLANKLINE>
    [test_lamp]
    "it is dark" = "say \\"light\\""
    """
    lines = [
        "# What people read and hear: situation = words. Written again by `pytest --write-golden`."
    ]
    for module, said in words.items():
        lines += ["", f"[{module if module.isidentifier() else json.dumps(module)}]"]
        lines += [f"{_string(situation)} = {_string(line)}" for situation, line in said.items()]
    return "\n".join(lines) + "\n"


def _string(value: str) -> str:
    """A basic string of TOML, which has the escapes of JSON, and is broken at its lines."""
    quoted = json.dumps(value, ensure_ascii=False)
    first, *rest = quoted[1:-1].split("\\n")
    return '"""\n' + "\n".join((first, *rest)) + '"""' if rest else quoted
