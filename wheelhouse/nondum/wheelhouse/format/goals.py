"""`goal.txt`: the goals of a payload, in words, while the payload is active.

A goal a line; empty lines, and those that begin with `#`, are passed over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from nondum.sdk.errors import PayloadRefused, Problem

NAME = "goal.txt"
MAX_BYTES = 1024
MAX_GOALS = 8
MAX_CHARACTERS = 200
"""Of one goal."""


def parse(data: bytes, where: str) -> tuple[str, ...]:
    """The goals in a file. Raises `PayloadRefused` (TOO_LARGE, NOT_UTF8, GOAL_FILE) with everything
    wrong in it."""
    if len(data) > MAX_BYTES:
        text, fix = "is too long", "say it in fewer words"
        need, have = f"at most {MAX_BYTES} bytes", f"{len(data)} bytes"
        raise PayloadRefused(Problem("TOO_LARGE", text, where, need, have, fix))
    try:
        lines = data.decode().split("\n")
    except UnicodeDecodeError as error:
        text = f"byte {error.start} is not UTF-8"
        raise PayloadRefused(Problem("NOT_UTF8", text, where=where)) from error
    numbered = [(number, line.strip()) for number, line in enumerate(lines, start=1)]
    wanted = [(n, line) for n, line in numbered if line and not line.startswith("#")]
    if problems := tuple(_problems(wanted, where)):
        raise PayloadRefused(*problems)
    return tuple(line for _, line in wanted)


def _problems(wanted: list[tuple[int, str]], where: str) -> Iterator[Problem]:
    if not wanted:
        fix = "write what is wanted in it, in words: follow me"
        yield Problem("GOAL_FILE", "there is no goal in it", where=where, fix=fix)
    for number, line in wanted:
        yield from _line_problems(line, f"{where}:{number}")
    if len(wanted) > MAX_GOALS:
        text = f"there are {len(wanted)} goals in it"
        yield Problem("GOAL_FILE", text, where, f"at most {MAX_GOALS}", fix="leave some out")


def _line_problems(line: str, where: str) -> Iterator[Problem]:
    if len(line) > MAX_CHARACTERS:
        need, have = f"at most {MAX_CHARACTERS} characters", f"{len(line)}"
        yield Problem("GOAL_FILE", "a goal is too long", where, need, have, "say it shorter")
    if not line.isprintable():
        text, fix = "a goal has letters in it that cannot be shown", "write it as plain text"
        yield Problem("GOAL_FILE", text, where=where, fix=fix)


def to_bytes(goals: Iterable[str]) -> bytes:
    """Goals as they stand in the file. Raises `PayloadRefused`, as `parse` does."""
    data = "".join(f"{goal.strip()}\n" for goal in goals).encode()
    parse(data, NAME)
    return data
