"""Whatever a person gets wrong, every command says so in words; none shows a traceback."""

from __future__ import annotations

import io
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from tests.docs.reference import all_commands

from nondum.cli import main
from nondum.sdk import codes

COMMANDS = {name: command for name, command, _ in all_commands()}
BUSY = {"nondum host run"}
"""Commands that would begin to work where others only ask; their options are tried all the same,
with values that keep them from it."""
ASKING = sorted(COMMANDS.keys() - BUSY)
WORDS = {
    "empty": "",
    "spaces": "   ",
    "line-feed": "a\nb",
    "escape-sequence": "\x1b[2J\x1b[31mred",
    "no-text": "a\udcffb",
    "long": "a" * 5000,
    "number": "-1",
    "letters": "\N{GREEK SMALL LETTER ALPHA}\N{ZERO WIDTH SPACE}",
    "parent-folders": "../../../../no/such/thing",
    "brackets": "((((((((",
}
FILES = ("missing", "empty", "noise", "folder", "loop")
TOLD = re.compile(r"^(error: [A-Z][A-Z0-9_-]+ |Usage: |Aborted|warning: )", re.MULTILINE)
MEANT = {0, 1, 2, 3, 4, 11, 12, 130}
"""Exit codes that docs/cli.md lists; 0, for what some commands make something of."""


@pytest.fixture(autouse=True)
def nowhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to be in, an empty home, no daemon, and no person who answers questions."""
    for name in ("HOME", "XDG_STATE_HOME", "XDG_CACHE_HOME", "XDG_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setenv("NONDUM_CONTROL", str(tmp_path / "control.sock"))
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO()))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").touch()
    (tmp_path / "noise").write_bytes(bytes(range(256)) * 40)
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    return tmp_path


def run(arguments: list[str], capfd: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    """In this process: whatever is raised but the exit is a failure of the test."""
    with pytest.raises(SystemExit) as end:
        main(arguments)
    out, err = capfd.readouterr()
    assert isinstance(end.value.code, int)
    return end.value.code, out, err


def parameters(name: str, kind: type[click.Parameter]) -> Iterator[click.Parameter]:
    for parameter in COMMANDS[name].params:
        if isinstance(parameter, kind) and not getattr(parameter, "is_flag", False):
            yield parameter


def filled(name: str, value: str, *options: str) -> list[str]:
    """The command with each of its arguments the same, after its options."""
    count = sum(max(1, parameter.nargs) for parameter in parameters(name, click.Argument))
    return [*name.split()[1:], *options, *(["--", *[value] * count] if count else [])]


def takes_json(name: str) -> bool:
    return any("--json" in parameter.opts for parameter in COMMANDS[name].params)


def judge(code: int, out: str, err: str) -> None:
    assert code in MEANT, (code, err)
    assert "Traceback" not in out + err
    assert "\x1b[2J" not in out + err, "a stranger's escape sequence reached the terminal"
    if code in (1, 2, 4):
        assert TOLD.search(err), f"exit {code} without a word: {err!r} {out!r}"
    for told in re.findall(r"^error: ([A-Z][A-Z0-9_-]+) ", err, re.MULTILINE):
        assert codes.find(told) is not None, told


@pytest.mark.parametrize("name", COMMANDS)
def test_unknown_options_are_told(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    code, out, err = run([*name.split()[1:], "--no-such-option"], capfd)
    assert (code, out) == (2, "")
    assert "No such option" in err or "Missing" in err


@pytest.mark.parametrize("name", ASKING)
def test_odd_words_are_told(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    for value in WORDS.values():
        judge(*run(filled(name, value), capfd))


@pytest.mark.parametrize("name", ASKING)
def test_odd_files_are_told(name: str, nowhere: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for file in FILES:
        judge(*run(filled(name, str(nowhere / file)), capfd))


@pytest.mark.parametrize("name", COMMANDS)
def test_odd_values_of_options_are_told(
    name: str, nowhere: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for option in parameters(name, click.Option):
        for value in ("", "no such thing", "\x1b[2J", str(nowhere / "noise")):
            values = [value] * option.nargs
            judge(*run(filled(name, "folder", option.opts[0], *values), capfd))


@pytest.mark.parametrize("name", sorted(name for name in ASKING if takes_json(name)))
def test_refusals_are_json_where_that_was_asked(
    name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    code, out, err = run(filled(name, "no such thing", "--json"), capfd)
    assert code in MEANT and err == ""
    json.loads(out)
