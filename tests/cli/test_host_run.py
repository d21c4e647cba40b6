"""Starting a host: every mistake is told in words, before anything has begun."""

from __future__ import annotations

import signal
import subprocess
from pathlib import Path

import pytest
from tests.kit.command_line import Ran, clean_environment, command, nondum
from tests.kit.running_host import RunningHost, running


def host_run(*arguments: str | Path) -> Ran:
    return nondum("host", "run", "--user", *arguments)


def test_every_mistake_of_a_configuration_is_told(tmp_path: Path) -> None:
    config = tmp_path / "host.toml"
    config.write_text('[host]\nnaem = "x"\n[workers]\ntasks = "many"\n', encoding="utf-8")
    ran = host_run("--config", config)
    for words in ("did you mean 'name'?", "[workers] tasks = 'many'", str(config)):
        ran.refused(2, words)
    assert ran.err.count("error: ") == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [("[host\n", "CONFIG_TOML"), ("a = 1\n" * 3, "CONFIG_TOML"), ("host = 3\n", "a table")],
    ids=["no TOML", "key thrice", "no table"],
)
def test_what_is_no_configuration_is_told(tmp_path: Path, text: str, words: str) -> None:
    config = tmp_path / "host.toml"
    config.write_text(text, encoding="utf-8")
    host_run("--config", config).refused(2, words)


def test_a_configuration_that_is_not_there_is_told(tmp_path: Path) -> None:
    ran = host_run("--config", tmp_path / "none.toml")
    ran.refused(2, "CONFIG_UNREADABLE").refused(2, "none.toml")
    host_run("--config", tmp_path).refused(2, "CONFIG_UNREADABLE")


@pytest.mark.parametrize("name", ["Spot 7", "a--b", "-a", "", "spot_7"])
def test_a_name_is_held_to_the_rules_of_the_configuration(tmp_path: Path, name: str) -> None:
    config = RunningHost(tmp_path).config
    host_run("--config", config, "--name", name).refused(2, "is not a host name")


def test_a_system_tree_that_is_none_is_told(tmp_path: Path) -> None:
    config = RunningHost(tmp_path).config
    text = config.read_text(encoding="utf-8")
    tree = '[host]\nsystem_tree = "unknown.module:it"'
    config.write_text(text.replace("[host]", tree), encoding="utf-8")
    ran = host_run("--config", config)
    ran.refused(2, "CONFIG_SYSTEM_TREE").refused(2, "unknown.module:it")


def test_a_state_folder_that_cannot_be_is_told(tmp_path: Path) -> None:
    host = RunningHost(tmp_path)
    host.state.write_text("a file", encoding="utf-8")
    ran = host_run("--config", host.config)
    ran.refused(2, "STATE_UNWRITABLE").refused(2, str(host.state))


def test_every_slot_folder_that_cannot_be_is_told(tmp_path: Path) -> None:
    host = RunningHost(tmp_path)
    for folder in (host.slots, host.devices):
        folder.rmdir()
        folder.write_text("a file", encoding="utf-8")
    ran = host_run("--config", host.config)
    ran.refused(2, f"CONFIG_FOLDER {host.slots}").refused(2, f"CONFIG_FOLDER {host.devices}")


def test_two_hosts_cannot_share_state_or_socket(tmp_path: Path) -> None:
    with running(tmp_path, name="panther") as host:
        host_run("--config", host.config).refused(2, "ALREADY_RUNNING")
        other = tmp_path / "other.toml"
        text = host.config.read_text(encoding="utf-8")
        other.write_text(text.replace("/state", "/state-2"), encoding="utf-8")
        host_run("--config", other).refused(2, "CONTROL_IN_USE")
        assert host.run("status").ok().out.startswith("host panther")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_host_ends_well_when_told_to(tmp_path: Path, number: signal.Signals) -> None:
    with running(tmp_path) as host:
        assert host.stop(number) == 0
        assert host.log.splitlines()[-1].partition("listens at")[1], host.log
        host.run("status").refused(4, "HOST_UNREACHABLE")


def test_defaults_of_a_user_need_no_configuration(tmp_path: Path) -> None:
    places = {"XDG_STATE_HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path / "run")}
    process = subprocess.Popen(
        command("host", "run", "--user", "--name", "lone-host"),
        stderr=subprocess.PIPE,
        text=True,
        env=clean_environment() | places,
    )
    assert process.stderr is not None
    with process:
        try:
            assert any("listens at" in line for line in process.stderr)
            assert nondum("status", **places).ok().out.startswith("host lone-host")
        finally:
            process.terminate()
