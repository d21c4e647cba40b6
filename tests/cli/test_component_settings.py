"""What an integrator sets of components on one host, over what their payload sets."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.kit.command_line import nondum
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost, payload, running

PICKY = """
'''Starts with just one brightness and colour.'''
from nondum.sdk import ConfigRefused, Problem, Unit, hookimpl

@hookimpl
def units():
    return [Unit("bulb", "device")]

@hookimpl
def start(ctx):
    has = [ctx.settings["brightness"], ctx.settings["colour"]]
    if has != [7, "red"]:
        raise ConfigRefused(Problem("SETTING_INVALID", f"has {has}"))
"""
OWN = '[component.settings]\nbrightness = 1\ncolour = "red"\n'
SET = '[[component]]\npayload = "org.example.lamp"\nid = "lamp"\nsettings = { brightness = 7 }\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "settings.toml"


@pytest.fixture
def host(tmp_path: Path, file: Path) -> Iterator[RunningHost]:
    with running(tmp_path, name="panther", more=f'[workers]\nsettings = "{file}"\n') as daemon:
        yield daemon


def refusal(host: RunningHost, name: str) -> str:
    host.plug(host.drive(name, Part("lamp", PICKY, manifest=OWN)))
    host.until_step(name, "refused", "quarantined")
    return host.run("status").ok().out


def test_host_sets_what_it_names_and_the_payload_the_rest(host: RunningHost, file: Path) -> None:
    file.write_text(SET, encoding="utf-8")
    host.bring("lamp", Part("lamp", PICKY, manifest=OWN))


def test_other_payloads_with_such_a_component_get_nothing(host: RunningHost, file: Path) -> None:
    file.write_text(SET, encoding="utf-8")
    assert "SETTING_INVALID" in refusal(host, "thief")


def test_mistake_in_the_file_refuses_what_is_plugged_and_nothing_else(
    host: RunningHost, file: Path
) -> None:
    file.write_text(f"{SET}[[component]]\n", encoding="utf-8")
    shown = refusal(host, "lamp")
    assert f"CONFIG_KEY {file}:5" in shown
    file.write_text(SET, encoding="utf-8")
    host.run("host", "resume", "--all").ok()
    host.until("it is active", lambda view: (payload(view, "lamp") or {})["state"] == "active")


def test_mistake_in_the_file_is_told_beforehand(tmp_path: Path, file: Path) -> None:
    config = tmp_path / "host.toml"
    config.write_text(f'[workers]\nsettings = "{file}"\n', encoding="utf-8")
    file.write_text("[[component]]\n", encoding="utf-8")
    nondum("config", "check", config).refused(3, f"CONFIG_KEY {file}:1")
    file.write_text(SET, encoding="utf-8")
    nondum("config", "check", config).ok()
