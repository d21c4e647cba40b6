"""The command line itself: help, exit codes, and what it does without a daemon."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
import pytest
from tests.cli.conftest import Answering
from tests.kit.command_line import (
    clean_environment,
    command,
    in_new_interpreter,
    in_terminal,
    nondum,
)

from nondum.cli.installed_commands import GROUP, installed_commands, summary
from nondum.cli.root import COMMANDS, cli
from nondum.cli.stop_first import STOP
from nondum.host.control.protocol import decode_request, encode_request, encode_result
from nondum.planning.words.stop_words import is_stop

ROOT_HELP = """\
Usage: nondum [OPTIONS] COMMAND [ARGS]...

  Rebuild a robot in the field: plug in a payload, and the robot plans with it.

  Example: nondum host run --user &
           nondum payload install DRIVE
           nondum goals

Options:
  --control PATH  The daemon's control socket [default: this user's, else the system's].
  --version       Show the version and exit.
  -h, --help      Show this message and exit.

Commands:
  advise      Which payloads would make a goal possible, and by which plan.
  behaviours  What the robot can do.
  completion  Print the script that completes commands in a shell.
  components  What the robot is made of at this moment.
  config      Check, show and explain the configuration, without a daemon.
  data        Models, maps and other data that are here, and which components see them.
  devices     What is plugged in, and who has it.
  doctor      Look for what is wrong around this host, without a daemon.
  explain     Say what a code means, where it comes from, and what to do.
  facts       What the robot believes, and why.
  goal        Give the robot a goal, in words or in PDDL.
  goals       What can be asked for now, and what was.
  halt        Halt what the robot is doing.
  host        Run the daemon.
  journal     What happened on this host, oldest first.
  keys        Whose payloads robots run, and which hosts a fleet certifies.
  lab         Plug a payload into an emulated computer, and tell what became of it.
  logs        What components have written.
  mount       Tell where on the body a unit is mounted.
  payload     Make, judge and install payloads.
  pddl        Check, merge and plan PDDL files, without a host.
  peers       Other hosts: which are here, and which this host trusts.
  place       Payloads that run on another host, and where one is to run.
  plan        The plans that are being carried out, that of the most urgent goal first.
  retry       Try again what was refused or quarantined.
  say         Say something to the robot, as if it had heard it.
  status      The host, its payloads and its goals at a glance.
  stop        Stop this host and its peers at once.
  store       The wheels and data that this host keeps.
  streams     The streams: their producers, readers and messages.
  tree        The behaviour tree as it is being ticked, and why.
  units       What the robot has to act with.
  watch       One live screen: what is wrong, goals, plan, parts, streams.
  why         Why the robot does what it does, or why it cannot.

  Exits with 0: done, 1: refused or failed, 2: wrong usage or bad input, 3: problems found, 4: no
  daemon.
"""
WHY = r"it is \u001b[2Jticked"
TREE = f'{{"result":{{"name":"nondum","status":"RUNNING","why":"{WHY}","children":[]}}}}\n'.encode()
NO_NAMES = b'{"result":{}}\n'
"""Of units and streams: none has a shorter one."""
HEAVY = (
    "asyncio",
    "rich",
    "nondum.planning",
    "nondum.wheelhouse",
    "nondum.host.config.host_config",
    "py_trees",
)
OF_DAEMONS = ("lark", "nondum.host.catalogue", "nondum.host.workers.workers")
IMPORTED = """
import json, sys
from nondum.cli import main
arguments, names = json.loads(sys.argv[1])
try:
    main(arguments)
except SystemExit:
    pass
print([name for name in names if name in sys.modules], file=sys.stderr)
"""


def commands() -> Iterator[tuple[str, click.Command]]:
    """Every command of every group, by what a person types."""
    context = click.Context(cli)
    for name in cli.list_commands(context):
        found = cli.get_command(context, name)
        assert found is not None
        yield from of(name, found)


def of(name: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    """A command, and if it is a group, all that are in it."""
    yield name, command
    if isinstance(command, click.Group):
        for inner, found in command.commands.items():
            yield from of(f"{name} {inner}", found)


ALL_COMMANDS = dict(commands())


def test_the_root_help_is_this() -> None:
    assert nondum("--help", COLUMNS="100").out == ROOT_HELP


def imported(names: Sequence[str], *arguments: str) -> str:
    """Which of these modules a command imports, at the end of what it tells."""
    orders = json.dumps([arguments, names])
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED, orders], capture_output=True, text=True, check=True
    )
    return done.stdout + done.stderr


def test_the_root_help_imports_nothing_heavy() -> None:
    told = imported(HEAVY, "--help")
    assert told.startswith("Usage: nondum")
    assert told.endswith("\n[]\n")


def test_a_payload_is_judged_without_what_only_daemons_need(tmp_path: Path) -> None:
    told = imported(OF_DAEMONS, "payload", "check", str(tmp_path))
    assert "DRIVE_NOT_PAYLOAD" in told
    assert told.endswith("\n[]\n")


HELPS = {name: told for name, (_, told) in COMMANDS.items()} | {
    name: summary(entry) for name, entry in installed_commands().items()
}


@pytest.mark.parametrize("name", HELPS)
def test_the_root_help_says_what_the_command_says(name: str) -> None:
    assert (ALL_COMMANDS[name].help or "").splitlines()[0] == HELPS[name]


@pytest.mark.parametrize(
    "module",
    ["", "import click\nraise RuntimeError\n", "mine = 1\n"],
    ids=["missing", "fails", "no command"],
)
def test_command_of_another_package_that_does_not_work_is_told(module: str, tmp_path: Path) -> None:
    package = tmp_path / "other-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Name: other\nVersion: 1.0\nSummary: What others do.\n")
    (package / "entry_points.txt").write_text(f"[{GROUP}]\nmine = other:mine\nhalt = other:mine\n")
    if module:
        (tmp_path / "other.py").write_text(module)
    others = {"PYTHONPATH": str(tmp_path)}
    helped = in_new_interpreter("--help", **others).ok().out
    assert re.search(r"^  mine +What others do\.$", helped, re.MULTILINE)
    in_new_interpreter("mine", **others).refused(2, "EXTENSION_BROKEN")
    assert in_new_interpreter("halt", "--help", **others).ok().out.startswith("Usage: nondum halt")


@pytest.mark.parametrize("name", ALL_COMMANDS)
def test_every_help_has_an_example_that_is_understood(name: str) -> None:
    text = ALL_COMMANDS[name].help or ""
    assert "Example" in text
    assert f"nondum {name}" in text


@pytest.mark.parametrize(
    "name",
    [n for n, c in ALL_COMMANDS.items() if not isinstance(c, click.Group)],
)
def test_every_command_but_those_without_a_result_knows_json(name: str) -> None:
    options = {option for param in ALL_COMMANDS[name].params for option in param.opts}
    assert ("--json" in options) == (name not in ("completion", "host run", "lab"))


def test_a_misspelt_command_is_guessed() -> None:
    nondum("statsu").refused(2, "No such command 'statsu'. Did you mean 'status'?")


def test_the_version_is_told() -> None:
    assert nondum("--version").ok().out.startswith("nondum, version ")


@pytest.mark.parametrize(
    "arguments",
    [
        ["goal"],
        ["goal", "follow me", "--pddl", "(lit self)"],
        ["goal", "follow me", "--maintain"],
        ["goal", "--pddl", "(lit self)", "--priority", "much"],
        ["mount", "some__unit"],
        ["mount", "some__unit", "--xyz", "1", "2", "three"],
        ["mount"],
        ["journal", "--limit", "0"],
        ["streams", "--count", "3"],
        ["completion", "tcsh"],
        ["payload", "check", "/nowhere/at/all"],
        ["payload", "build"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_told_with_its_own_exit_code(arguments: list[str]) -> None:
    nondum(*arguments).refused(2, "Error: ")


def test_wrong_usage_is_json_where_json_was_asked_for(tmp_path: Path) -> None:
    ran = nondum("pddl", "check", tmp_path / "none.pddl", "--json")
    assert ran.code == 2
    [problem] = ran.json["problems"]
    assert problem["code"] == "USAGE"
    assert "none.pddl'" in problem["message"]


def test_no_daemon_is_told_with_its_own_exit_code(tmp_path: Path) -> None:
    nowhere = tmp_path / "control.sock"
    ran = nondum("--control", nowhere, "status")
    ran.refused(4, "error: HOST_UNREACHABLE").refused(4, "`nondum host run --user`")
    assert ran.out == ""


def test_the_robot_is_stopped_before_the_rest_is_imported(tmp_path: Path) -> None:
    """A command line that cannot be imported at all has stopped it."""
    (tmp_path / "click.py").write_text("raise SystemExit(7)\n")
    path = tmp_path / "control.sock"
    with socket.socket(socket.AF_UNIX) as daemon:
        daemon.bind(str(path))
        daemon.listen()
        ran = in_new_interpreter("stop", PYTHONPATH=str(tmp_path), NONDUM_CONTROL=str(path))
        assert ran.code == 7
        connection, _ = daemon.accept()
        with connection, connection.makefile("rb") as lines:
            request = decode_request(lines.readline())
    assert request.verb == "goal"
    assert is_stop(request.arguments["words"])
    assert encode_request(request) == STOP


def test_what_was_stopped_is_shown(answering: Answering) -> None:
    stopped = {"goals": ["3"], "halted": [], "peers": ["base"]}
    control = answering(encode_result({"stopped": stopped}), NO_NAMES)
    assert nondum("stop", NONDUM_CONTROL=str(control)).ok().out == (
        "goal 3 is halted\nbase has stopped\n"
    )


def test_the_usual_sockets_are_tried_in_turn(tmp_path: Path) -> None:
    environment = {"XDG_RUNTIME_DIR": str(tmp_path / "run"), "XDG_STATE_HOME": str(tmp_path)}
    nondum("status", **environment).refused(4, "/run/nondum/control.sock")


def test_the_socket_that_a_killed_daemon_left_is_named(tmp_path: Path) -> None:
    left = tmp_path / "run/nondum/control.sock"
    left.parent.mkdir(parents=True)
    with socket.socket(socket.AF_UNIX) as daemon:
        daemon.bind(str(left))
    environment = {"XDG_RUNTIME_DIR": str(tmp_path / "run"), "XDG_STATE_HOME": str(tmp_path)}
    nondum("status", **environment).refused(4, str(left))


def test_a_refusal_is_json_where_json_was_asked_for(tmp_path: Path) -> None:
    ran = nondum("--control", tmp_path / "control.sock", "status", "--json")
    assert ran.code == 4
    assert [problem["code"] for problem in ran.json["problems"]] == ["HOST_UNREACHABLE"]
    assert ran.err == ""


def test_a_daemon_of_another_kind_is_told(answering: Answering) -> None:
    control = answering(b"220 smtp.example.org\n")
    nondum("--control", control, "status").refused(1, "CONTROL_ANSWER")


@pytest.mark.parametrize("answer", [b"", b'{"result": {"host'], ids=["nothing", "half an answer"])
def test_a_daemon_that_goes_mid_question_is_told(answering: Answering, answer: bytes) -> None:
    nondum("--control", answering(answer), "status").refused(4, "the daemon hung up")


def test_a_daemon_that_goes_while_it_is_followed_is_told(answering: Answering) -> None:
    ran = nondum("--control", answering(TREE), "tree", "--follow", "--json")
    assert ran.code == 4
    assert '"name":"nondum"' in ran.out


def test_names_are_asked_for_again_only_when_another_one_is_shown(answering: Answering) -> None:
    """The daemon answers as often as it is asked here: one more call finds no daemon."""
    other = TREE.replace(WHY.encode(), b"rover__eye__camera")
    assert other != TREE
    named = b'{"result":{"rover__eye__camera":"camera"}}\n'
    control = answering(TREE + TREE + other + other, NO_NAMES, named)
    ran = nondum("--control", control, "tree", "--follow")
    shown = [line for line in ran.out.splitlines() if "nondum" in line]
    assert len(shown) == 4, ran.out
    assert ran.out.count("camera") == 2 and "rover__" not in ran.out


def test_ctrl_c_ends_following_in_silence(answering: Answering) -> None:
    control = answering(TREE, hangs_up=False)
    process = subprocess.Popen(
        command("--control", control, "tree", "--follow", "--json"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=clean_environment() | {"PYTHONUNBUFFERED": "1"},
    )
    assert process.stdout is not None
    assert '"name":"nondum"' in process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (130, "")


def test_a_reader_that_leaves_ends_it_in_silence(answering: Answering) -> None:
    read, write = os.pipe()
    os.close(read)
    with open(write, "wb") as broken:  # noqa: PTH123  # it is a descriptor, not a path
        done = subprocess.run(
            command("--control", answering(TREE, NO_NAMES), "tree"),
            stdout=broken,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.parametrize("wants_colour", [True, False], ids=["plain", "NO_COLOR"])
def test_colour_is_for_terminals_that_want_it(answering: Answering, wants_colour: bool) -> None:
    environment = {} if wants_colour else {"NO_COLOR": "1"}
    shown = in_terminal("--control", answering(TREE, NO_NAMES), "tree", **environment)
    assert "nondum" in shown
    assert ("\x1b[33m▶" in shown) == wants_colour


def test_no_colour_in_a_pipe(answering: Answering) -> None:
    ran = nondum("--control", answering(TREE, NO_NAMES), "tree").ok()
    assert ran.out == "▶ nondum  — it is \\x1b[2Jticked\n"
