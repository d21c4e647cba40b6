"""`nondum config`: all that is wrong at once, what holds and who says so, what a key means."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.kit.command_line import nondum
from tests.kit.golden import Golden

WRONG = """[host]
naem = "spot"

[workers]
tasks = "many"
memory_mb = -1

[drivs]
"""


def written(folder: Path, text: str) -> Path:
    file = folder / "host.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_all_problems_are_told_at_once_each_with_its_line(tmp_path: Path, golden: Golden) -> None:
    file = written(tmp_path, WRONG)
    done = nondum("config", "check", file)
    done.refused(3, "CONFIG_KEY")
    golden.check("four mistakes at once", done.err, file=file)
    told = nondum("config", "check", "--json", file)
    codes = [problem["code"] for problem in told.json["problems"]]
    assert (told.code, told.json["ok"]) == (3, False)
    assert codes == ["CONFIG_KEY", "CONFIG_VALUE", "CONFIG_VALUE", "CONFIG_KEY"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[host\n", "CONFIG_TOML"),
        ('[host]\nsystem_tree = "unknown.module:it"\n', "CONFIG_SYSTEM_TREE"),
    ],
)
def test_what_a_daemon_would_not_start_with_is_told(tmp_path: Path, text: str, words: str) -> None:
    nondum("config", "check", written(tmp_path, text)).refused(3, words)


def test_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    nondum("config", "check", tmp_path / "none.toml").refused(3, "CONFIG_UNREADABLE")


def test_file_that_is_right_is_said_to_be(tmp_path: Path, golden: Golden) -> None:
    file = written(tmp_path, '[host]\nname = "spot"\n')
    golden.check("a file is right", nondum("config", "check", file).ok().out, file=file)
    assert nondum("config", "check", "--json", file).ok().json["ok"]
    assert "by default" in nondum("config", "check", "--user").ok().out


def test_key_that_has_no_effect_while_peers_are_off_is_warned_of(tmp_path: Path) -> None:
    file = written(tmp_path, '[peers]\nenabled = false\nstatic = ["10.0.0.7"]\n')
    told = nondum("config", "check", "--json", file).ok().json
    assert [(warning["code"], warning["where"]) for warning in told["warnings"]] == [
        ("CONFIG_UNUSED", f"{file}:3")
    ]
    done = nondum("config", "check", file)
    assert done.code == 0
    assert f"CONFIG_UNUSED {file}:3" in done.err
    assert "is right" in done.out


@pytest.mark.parametrize(
    ("text", "arguments", "is_on"),
    [
        ("", (), False),
        ("[peers]\nplace = false\n", (), False),
        ("", ("--peer", "10.0.0.7"), True),
        ('[peers]\nstatic = ["10.0.0.7"]\n', (), True),
        ('[peers]\nlisten = ["tcp://*:7500"]\n', (), True),
        ("[peers]\ndevelopment = true\n", (), True),
        ('[router]\nendpoints = ["tcp/10.0.0.1:7447"]\n', (), True),
        ('[peers]\nenabled = false\nstatic = ["10.0.0.7"]\n', (), False),
    ],
)
def test_host_of_a_user_has_peers_where_somebody_says_how_they_are_reached(
    text: str, arguments: tuple[str, ...], is_on: bool, tmp_path: Path
) -> None:
    file = written(tmp_path, text)
    shown = nondum("config", "show", "--user", "--config", file, *arguments, "--json").ok().json
    found = {row["key"]: row["value"] for row in shown["settings"]}
    assert found["peers.enabled"] is is_on


def test_every_key_is_shown_with_who_says_it(tmp_path: Path) -> None:
    file = written(
        tmp_path,
        '[host]\nname = "spot"\n[planning]\n\ndeadline_s = 3\n[workers]\nconfinement = 2\n',
    )
    arguments = ("--user", "--config", file, "--name", "rex", "--peer", "10.0.0.7")
    shown = nondum("config", "show", *arguments, "--json", XDG_STATE_HOME="/there").ok().json
    found = {row["key"]: (row["value"], row["from"]) for row in shown["settings"]}
    assert found["host.name"] == ("rex", "--name")
    assert found["planning.deadline_s"] == (3.0, f"{file}:5")
    assert found["workers.confinement"] == ("sandboxed", f"{file}:7")
    assert found["workers.minimum_confinement"] == ("none", "default with --user")
    assert found["peers.static"] == (["10.0.0.7"], "--peer")
    assert found["host.state"] == ("/there/nondum", "default with --user")
    assert found["install.method"] == ("store", "default")


def test_what_a_router_makes_false_is_shown_with_the_reason(tmp_path: Path, golden: Golden) -> None:
    router = '[router]\nendpoints = ["tcp/10.0.0.1:7447"]\n'
    file = written(tmp_path, router + "[peers]\nplace = true\n")
    shown = nondum("config", "show", "--config", file, "--json").ok().json
    found = {row["key"]: (row["value"], row["from"]) for row in shown["settings"]}
    is_accepted, source = found["peers.accept_goals"]
    assert not is_accepted
    golden.check("a router changes a default", source)
    assert found["peers.place"] == (True, f"{file}:4")


def test_what_is_not_as_by_default_is_shown_alone(tmp_path: Path) -> None:
    file = written(tmp_path, '[drives]\nslots = ["/a"]\n')
    lines = nondum("config", "show", "--set", "--config", file).ok().out.splitlines()
    assert [line.split() for line in lines] == [
        ["KEY", "VALUE", "FROM"],
        ["drives.slots", '["/a"]', f"{file}:2"],
    ]


def test_settings_of_a_wrong_file_are_not_shown(tmp_path: Path) -> None:
    nondum("config", "show", "--config", written(tmp_path, WRONG)).refused(2, "host.toml:2")


def test_key_is_explained_with_unit_default_and_example(golden: Golden) -> None:
    out = nondum("config", "explain", "workers.memory_mb").ok().out
    assert out.startswith("[workers] memory_mb\nMemory of all its processes")
    golden.check_line("a key has a unit", out)
    golden.check_line("a key has a default", out)
    assert "    [workers]\n    memory_mb = 2048\n" in out


def test_key_is_found_by_its_name_alone_where_that_tells_it() -> None:
    assert nondum("config", "explain", "on_revoke").ok().out.startswith("[trust] on_revoke")
    nondum("config", "explain", "memory_mb").refused(
        2, "did you mean workers.memory_mb or planning.memory_mb?"
    )
    nondum("config", "explain", "workers.memroy_mb").refused(2, "workers.memory_mb")


def test_all_keys_are_listed_for_those_who_ask_for_none() -> None:
    assert "drives.slots" in nondum("config", "explain").ok().out
    rows = nondum("config", "explain", "--json").ok().json["keys"]
    assert all(row["meaning"] and row["example"] and row["kind"] for row in rows)
