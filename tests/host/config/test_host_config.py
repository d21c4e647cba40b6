"""The configuration file: read over defaults, every mistake told at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.kit import version_before
from tests.kit.golden import Golden

from nondum.host.config.host_config import HostConfig, default_name
from nondum.host.config.parsing import HOST_NAME as HOST_NAME_PATTERN
from nondum.host.config.parsing import load, parse
from nondum.sdk.errors import ConfigRefused
from nondum.wheelhouse.format.confinement import Level


def refused(text: str) -> list[str]:
    with pytest.raises(ConfigRefused) as caught:
        parse(text, "host.toml", HostConfig())
    return [str(problem) for problem in caught.value.problems]


def test_an_empty_file_gives_the_defaults() -> None:
    assert parse("", "host.toml", HostConfig()) == HostConfig()


def test_what_is_written_stands_over_the_defaults() -> None:
    config = parse(
        '[host]\nname = "spot"\n[drives]\nslots = ["/a", "/b"]\n[planning]\ndeadline_s = 3\n',
        "host.toml",
        HostConfig(),
    )
    assert config.host.name == "spot"
    assert config.drives.slots == (Path("/a"), Path("/b"))
    assert config.planning.deadline_s == 3.0
    assert config.host.state == HostConfig().host.state


@pytest.mark.parametrize(
    ("value", "level"),
    [
        ('"sandboxed"', Level.SANDBOXED),
        ('"3"', Level.SANDBOXED),
        ("3", Level.SANDBOXED),
        ('"2"', Level.SANDBOXED),
        ('"restricted"', Level.RESTRICTED),
        ("1", Level.RESTRICTED),
        ('"none"', Level.NONE),
        ('"0"', Level.NONE),
    ],
)
def test_levels_of_confinement_are_named_or_numbered(value: str, level: Level) -> None:
    text = f"[workers]\nconfinement = {value}\nminimum_confinement = {value}\n"
    workers = parse(text, "host.toml", HostConfig()).workers
    assert (workers.confinement, workers.minimum_confinement) == (level, level)


def test_file_of_the_version_before_is_taken_with_each_of_its_keys() -> None:
    """None was renamed since; a key that is to be one day must be refused with its new name."""
    config = load(version_before.DATA / "host.toml", HostConfig())
    assert config.host.name == "panther"
    assert config.workers.minimum_confinement is Level.RESTRICTED


def test_the_best_confinement_may_be_asked_for() -> None:
    text = '[workers]\nconfinement = "auto"\n'
    assert parse(text, "host.toml", HostConfig()).workers.confinement == "auto"


@pytest.mark.parametrize(
    ("value", "shown"),
    [('"high"', "'high'"), ("4", "4"), ("true", "True"), ('["none"]', "['none']")],
)
def test_what_is_no_level_of_confinement_is_refused(value: str, shown: str, golden: Golden) -> None:
    text = f"[workers]\nconfinement = {value}\nminimum_confinement = {value}\n"
    highest, least = refused(text)
    golden.check("no level of confinement", highest, value=shown)
    golden.check("no least level of confinement", least, value=shown)


def test_a_relative_path_is_taken_from_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    config = parse('[host]\nstate = "s"\n[drives]\nslots = ["d"]\n', "host.toml", HostConfig())
    assert config.host.state == tmp_path / "s"
    assert config.drives.slots == (tmp_path / "d",)


@pytest.mark.parametrize("written", ["~no.such.user/x", "a\\u0000", ""])
@pytest.mark.parametrize("line", ['[host]\nstate = "{}"', '[drives]\nslots = ["/a", "{}"]'])
def test_what_names_no_path_is_refused(line: str, written: str) -> None:
    (problem,) = refused(line.format(written))
    assert problem.startswith("CONFIG_VALUE host.toml:2: ")


def test_all_mistakes_are_told_at_once() -> None:
    remedy = " → correct it; docs/configuration.md says what is expected"
    assert refused(
        '[host]\nname = "Spot 7"\nstat = "/x"\n[drives]\nslots = "/a"\n[dirves]\n'
        '[install]\nmethod = "conda"\nreserve_mb = true\n'
    ) == [
        "CONFIG_KEY host.toml:3 [host]: unknown key 'stat' → did you mean 'state'?",
        "CONFIG_VALUE host.toml:5: [drives] slots = '/a': expected a list of paths, each "
        "a path as a string; `~user/` only of a user of this host" + remedy,
        "CONFIG_KEY host.toml:6: unknown key 'dirves' → did you mean 'drives'?",
        "CONFIG_VALUE host.toml:9: [install] reserve_mb = True: expected a whole number of at "
        "least 0" + remedy,
        "CONFIG_VALUE host.toml:2: [host] name = 'Spot 7' is not a host name → lower-case letters, "
        "digits and single hyphens: 'spot-7'",
        'CONFIG_VALUE host.toml:8: [install] method = \'conda\': expected "store" or "pip"'
        + remedy,
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[host", "CONFIG_TOML host.toml:1: Expected ']'"),
        pytest.param(
            f"[planning]\ndeadline_s = {'9' * 5_000}",
            "CONFIG_TOML host.toml:2: Exceeds the limit",
            id="number without end",
        ),
        pytest.param(
            f"[host]\nstate = 0x{'f' * 5_000}",
            "CONFIG_VALUE host.toml:2: [host] state = a value too long to be shown",
            id="hexadecimal number without end",
        ),
        ("\na = 1\na = 2", "CONFIG_TOML host.toml:3: Cannot overwrite"),
        ("host = 3", "CONFIG_VALUE host.toml:1: [host] = 3: expected a table"),
        ('[host]\nsystem_tree = "tree"', 'expected "package:function"'),
        ("[planning]\ndeadline_s = 0", "expected a number above 0"),
    ],
)
def test_a_mistake_names_place_and_expectation(text: str, words: str) -> None:
    (problem,) = refused(text)
    assert words in problem


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('lamps = ["../../x"]', "a name in /sys/class/leds"),
        ('hook = ["tell"]', "a program by its full path"),
        ('player = ["aplay", "-q"]', "a program by its full path"),
        ('hook = ["/bin/tell", "a\\u0000"]', "words without NUL"),
        ("refused_s = 0", "a number above 0"),
    ],
)
def test_a_mistake_in_what_shows_the_state_is_told(line: str, words: str) -> None:
    (problem,) = refused(f"[feedback]\n{line}\n")
    assert words in problem
    assert "host.toml:2" in problem


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigRefused, match="CONFIG_UNREADABLE"):
        load(tmp_path / "none.toml", HostConfig())


@given(st.text())
def test_any_machine_name_gives_a_host_name(hostname: str) -> None:
    assert HOST_NAME_PATTERN.fullmatch(default_name(hostname))


@given(st.text())
def test_any_text_is_a_config_or_refused(text: str) -> None:
    try:
        parse(text, "host.toml", HostConfig())
    except ConfigRefused as error:
        assert all(problem.code.startswith("CONFIG_") for problem in error.problems)


ROUTER = '[router]\nendpoints = ["tls/router.example:7447"]\n'


@pytest.mark.parametrize(
    ("text", "takes"),
    [
        ("", (True, True)),
        (ROUTER, (False, False)),
        (ROUTER + "[peers]\naccept_goals = true\n", (True, False)),
        (ROUTER + "[peers]\nplace = true\n", (False, True)),
        ("[peers]\nplace = true\naccept_goals = true\n" + ROUTER, (True, True)),
        ("[peers]\nplace = false\n", (True, False)),
        ("[router]\nfleet = 'other'\n", (True, True)),
    ],
)
def test_peers_that_prove_no_keys_give_nothing_unless_the_file_says_so(
    text: str, takes: tuple[bool, bool]
) -> None:
    peers = parse(text, "host.toml", HostConfig()).peers
    assert (peers.accept_goals, peers.place) == takes


def test_peers_that_are_no_table_are_told_with_a_router_too() -> None:
    (told,) = refused("peers = 1\n" + ROUTER)
    assert told.startswith("CONFIG_VALUE host.toml:1")
