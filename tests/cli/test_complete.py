"""What a shell completes, from the running host and without one."""

from __future__ import annotations

import subprocess

import pytest
from tests.kit.beacon import BEACON_ID, BRIGHTNESS, LAMP
from tests.kit.command_line import nondum
from tests.kit.running_host import RunningHost


def completed(daemon: RunningHost, line: str) -> list[str]:
    """What bash would offer for the last word of a line."""
    words = line.split(" ")
    ran = nondum(
        COMP_WORDS=line.rstrip(),
        COMP_CWORD=str(len(words) - 1),
        _NONDUM_COMPLETE="bash_complete",
        NONDUM_CONTROL=str(daemon.control),
    )
    assert ran.err == ""
    return [text.removeprefix("plain,") for text in ran.out.split()]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("nondum st", ["status", "stop", "store", "streams"]),
        ("nondum payload in", ["inspect", "install"]),
        ("nondum completion ", ["bash", "fish", "zsh"]),
        ("nondum logs ", ["beacon"]),
        ("nondum mount panther__", [LAMP]),
        ("nondum streams --follow ", [BRIGHTNESS]),
        ("nondum retry ", []),
        ("nondum goal ", ["greet", "shine"]),
        ("nondum goal gr", ["greet"]),
        ("nondum goal Greet ", ["people"]),
        ("nondum goal greet people ", []),
        ("nondum goal shine fo", []),
        ("nondum journal --subject ", [BEACON_ID, "beacon"]),
        ("nondum payload uninstall ", []),
        ("nondum plan --j", ["--json"]),
    ],
)
def test_the_host_says_what_fits(daemon: RunningHost, line: str, offered: list[str]) -> None:
    assert completed(daemon, line) == offered


def test_open_goals_are_offered_to_be_halted(daemon: RunningHost) -> None:
    id = daemon.run("goal", "--pddl", "(reported person self)", "--json").ok().json["id"]
    try:
        assert completed(daemon, "nondum halt --goal ") == [id]
    finally:
        daemon.run("halt", "--now").ok()
    assert completed(daemon, "nondum halt --goal ") == []


def test_without_a_daemon_nothing_is_offered_and_nothing_said() -> None:
    ran = nondum(
        COMP_WORDS="nondum mount",
        COMP_CWORD="2",
        _NONDUM_COMPLETE="bash_complete",
        NONDUM_CONTROL="/nowhere/control.sock",
    )
    assert (ran.code, ran.out, ran.err) == (0, "\n", "")


@pytest.mark.parametrize("shell", ["bash", "fish", "zsh"])
def test_the_script_of_a_shell_asks_nondum(shell: str) -> None:
    script = nondum("completion", shell).ok().out
    assert f"_NONDUM_COMPLETE={shell}_complete" in script


def test_bash_understands_its_script() -> None:
    script = nondum("completion", "bash").ok().out
    subprocess.run(["bash", "-n"], input=script, text=True, check=True)
