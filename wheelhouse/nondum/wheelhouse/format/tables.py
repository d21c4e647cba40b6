"""Reading hand-written TOML: typed values out, every mistake told at once with its line."""

from __future__ import annotations

import difflib
import math
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from nondum.sdk.errors import PayloadRefused, Problem
from nondum.sdk.frozen import frozen

MAX_BYTES = 64 * 1024
MAX_DOTS = 8
"""Parts of a dotted key: tomllib takes quadratic time over them."""

# Begun only where a part begins: a long word would be read again from each of its letters.
_MANY_DOTS = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]+\s*\.\s*){" + str(MAX_DOTS) + "}")
_HEADER = re.compile(r"\s*(\[\[?)\s*([\w.-]+)\s*\]")
_ASSIGNMENT = re.compile(r"\s*[\"']?([\w-]+)[\"']?\s*=")

T = TypeVar("T")


@frozen
class Form:
    """What a string must look like, for machines and in words."""

    pattern: re.Pattern[str]
    words: str


PLAIN = Form(re.compile(r"[^\x00-\x1f\x7f\u202a-\u202e\u2066-\u2069]{0,4000}"), "plain text")


@dataclass
class Report:
    """Where a file's mistakes are gathered."""

    code: str
    """Prefix of the codes: `MANIFEST` gives `MANIFEST_KEY`."""
    where: str
    text: str
    problems: list[Problem] = field(default_factory=list)
    _counts: Counter[str] = field(default_factory=Counter)

    def next_index(self, table: str) -> int:
        """How many tables of that name were read before: arrays are read in the file's order."""
        self._counts[table] += 1
        return self._counts[table] - 1

    def add(self, kind: str, message: str, line: int | None = None, fix: str = "") -> None:
        """Note a mistake."""
        place = self.where if line is None else f"{self.where}:{line}"
        self.problems.append(Problem(f"{self.code}_{kind}", message, where=place, fix=fix))

    def raise_if_any(self) -> None:
        """Raise `PayloadRefused` with all that was noted."""
        if self.problems:
            raise PayloadRefused(*self.problems)

    def line_of(self, table: str, index: int, key: str) -> int | None:
        """The line that assigns `key` in the `index`-th table of that name, else its header's."""
        current, seen = "", -1
        header_line = None
        for number, line in enumerate(self.text.splitlines(), start=1):
            if header := _HEADER.match(line):
                current = header[2]
                if current == table:
                    seen += 1
                    header_line = number if seen == index or header[1] == "[" else header_line
            elif current == table and (seen == index or (not table and seen == -1)):
                assigned = _ASSIGNMENT.match(line)
                if assigned and assigned[1] == key:
                    return number
        return header_line


LARGEST = 2**63 - 1
"""Of a whole number: what 64 bits hold (TOML 1.0, Integer)."""


class Table:
    """One table being read: take its keys, then `close` it to have unknown ones told."""

    def __init__(self, data: Mapping[str, Any], report: Report, name: str = "") -> None:
        self._data = data
        self._report = report
        self._name, self._index = name, report.next_index(name)
        self._taken: list[str] = []

    def text(self, key: str, form: Form = PLAIN, *, default: str | None = None) -> str:
        """A string of that form; required unless there is a default."""
        value = self._take(key, default)
        if value is None:
            return ""
        if not isinstance(value, str):
            self.wrong(key, f"expected a string, found {_kind(value)}")
        elif not form.pattern.fullmatch(value):
            self.wrong(key, f"{value[:60]!r} is not {form.words}")
        else:
            return value
        return ""

    def integer(self, key: str, default: int) -> int:
        """A whole number of at least 0 and at most `LARGEST`."""
        value = self._take(key, default)
        if type(value) is not int or not 0 <= value <= LARGEST:
            expected = f"a whole number from 0 to {LARGEST}"
            self.wrong(key, f"expected {expected}, found {_shown(value)}")
            return default
        return value

    def flag(self, key: str) -> bool:
        """True or false; false when it is left out."""
        value = self._take(key, default=False)
        if type(value) is not bool:
            self.wrong(key, f"expected true or false, found {_shown(value)}")
            return False
        return value

    def parsed(self, key: str, parse: Callable[[object], T], default: T) -> T:
        """What `parse` reads; it raises `ValueError` with what it expects."""
        value = self._take(key, default)
        if value is default:
            return default
        try:
            return parse(value)
        except ValueError as error:
            self.wrong(key, f"{error}, found {_shown(value)}")
            return default

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of strings; empty when it is left out."""
        value = self._take(key, [])
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            self.wrong(key, f"expected a list of strings, found {_shown(value)}")
            return ()
        for item in value:
            if not PLAIN.pattern.fullmatch(item):
                self.wrong(key, f"{item[:60]!r} is not {PLAIN.words}")
        return tuple(value)

    def numbers(self, key: str, count: int) -> tuple[float, ...]:
        """A list of `count` numbers; zeros when it is left out."""
        value = self._take(key, [0.0] * count)
        is_number = [_is_number(item) for item in value] if isinstance(value, list) else []
        if len(is_number) != count or not all(is_number):
            self.wrong(key, f"expected a list of {count} finite numbers, found {_shown(value)}")
            return (0.0,) * count
        return tuple(float(item) for item in value)

    def strings(self, key: str) -> dict[str, str]:
        """A table of at least one string, for example udev properties."""
        value = self._take(key, {})
        if not isinstance(value, dict) or not all(isinstance(v, str) for v in value.values()):
            self.wrong(key, f"expected a table of strings, found {_shown(value)}")
            return {}
        if not value:
            self.wrong(key, "expected a table of at least one string")
        return dict(value)

    def free(self, key: str) -> dict[str, Any]:
        """A table whose keys are somebody else's affair; its values can stand in any message."""
        value = self._dict(key)
        if not _is_plain(value):
            self.wrong(key, "has a value other than text, true, false, 64-bit and finite numbers")
            return {}
        return value

    def table(self, key: str) -> Table:
        """The table under a key; empty when it is left out."""
        return Table(self._dict(key), self._report, self._full(key))

    def optional_table(self, key: str) -> Table | None:
        """The table under a key; None when it is left out: of several tables only some have it."""
        if key in self._data:
            return self.table(key)
        self._taken.append(key)
        return None

    def tables(self, key: str, *, required: bool = False) -> Sequence[Table]:
        """An array of tables."""
        value = self._take(key, None if required else [])
        if value is None:
            return ()
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self.wrong(key, f"expected tables [[{self._full(key)}]], found {_shown(value)}")
            return ()
        return [Table(item, self._report, self._full(key)) for item in value]

    def wrong(self, key: str, message: str, fix: str = "") -> None:
        """Note a mistake in the value of a key."""
        name = f"[{self._name}] {key}" if self._name else key
        self._report.add("VALUE", f"{name}: {message}", self._line(key), fix)

    def close(self) -> None:
        """Report every key that was not read."""
        for key in self._data:
            if key in self._taken:
                continue
            near = difflib.get_close_matches(key, self._taken, n=1)
            fix = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(self._taken)}"
            place = f" in [{self._name}]" if self._name else ""
            self._report.add("KEY", f"unknown key {key!r}{place}", self._line(key), fix)

    def _take(self, key: str, default: Any) -> Any:
        self._taken.append(key)
        if key not in self._data and default is None:
            place = f" in [{self._name}]" if self._name else ""
            self._report.add("KEY", f"key {key!r} is missing{place}", self._line(key))
        return self._data.get(key, default)

    def _dict(self, key: str) -> dict[str, Any]:
        value = self._take(key, {})
        if not isinstance(value, dict):
            self.wrong(key, f"expected a table, found {_shown(value)}")
            return {}
        return value

    def _line(self, key: str) -> int | None:
        return self._report.line_of(self._name, self._index, key)

    def _full(self, key: str) -> str:
        return f"{self._name}.{key}" if self._name else key


def read(text: str, code: str, where: str) -> tuple[Table, Report]:
    """Parse TOML. Raises `PayloadRefused` (…_TOML, TOO_LARGE) when it is none."""
    report = Report(code, where, text)
    if len(text.encode()) > MAX_BYTES:
        raise PayloadRefused(Problem("TOO_LARGE", f"is longer than {MAX_BYTES} bytes", where=where))
    if _MANY_DOTS.search(text):
        report.add("TOML", f"a key has more than {MAX_DOTS} dotted parts")
        report.raise_if_any()
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        report.add("TOML", f"is not TOML: {error}", fix="see https://toml.io")
        raise PayloadRefused(*report.problems) from error
    return Table(data, report), report


def _is_number(value: Any) -> bool:
    """Whether it is a number that fits a message and a float."""
    return (type(value) is int and -(2**63) <= value < 2**63) or (
        type(value) is float and math.isfinite(value)
    )


def _is_plain(value: Any) -> bool:
    if isinstance(value, dict):
        return all(_is_plain(item) for item in value.values())
    if isinstance(value, list):
        return all(_is_plain(item) for item in value)
    return type(value) in (str, bool) or _is_number(value)


def _kind(value: Any) -> str:
    kinds = {bool: "true or false", int: "a number", float: "a number", list: "a list"}
    return kinds.get(type(value), "a table" if isinstance(value, dict) else type(value).__name__)


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return "a table"
    try:
        return f"{_kind(value)} {str(value)[:40]!r}"
    except ValueError:  # of a number with thousands of digits (sys.set_int_max_str_digits)
        return f"{_kind(value)} too long to be shown"
