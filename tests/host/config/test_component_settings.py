"""The file with settings of components: what it says, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from nondum.host.config.component_settings import load, parse
from nondum.sdk.errors import ConfigRefused

LAMP = '[[component]]\npayload = "org.example.lamp"\nid = "lamp"\n'


def test_each_component_of_a_payload_has_its_settings() -> None:
    text = (
        f"{LAMP}[component.settings]\nbrightness = 0.5\nshades = {{ red = [1, 2] }}\n"
        '[[component]]\npayload = "org.example.horn"\nid = "horn"\nsettings = { loud = true }\n'
    )
    assert parse(text, "settings.toml") == {
        ("org.example.lamp", "lamp"): {"brightness": 0.5, "shades": {"red": [1, 2]}},
        ("org.example.horn", "horn"): {"loud": True},
    }


def test_no_file_sets_nothing() -> None:
    assert load(None) == {}


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        ("[component", "CONFIG_TOML", "settings.toml"),
        ("[lamp]\n", "CONFIG_KEY", "settings.toml"),
        ('[[component]]\nid = "lamp"\n', "CONFIG_KEY", "settings.toml:1"),
        (f"{LAMP}setting = {{}}\n", "CONFIG_KEY", "settings.toml:4"),
        (LAMP.replace("org.example.", "/"), "CONFIG_VALUE", "settings.toml:2"),
        (f"{LAMP}settings = 3\n", "CONFIG_VALUE", "settings.toml:4"),
        (f"{LAMP}settings = {{ since = 2026-01-01 }}\n", "CONFIG_VALUE", "settings.toml:4"),
        (f"{LAMP}{LAMP}", "CONFIG_TWICE", "settings.toml"),
        ("x" * 70_000, "TOO_LARGE", "settings.toml"),
    ],
)
def test_a_mistake_is_told_with_its_place(text: str, code: str, place: str) -> None:
    with pytest.raises(ConfigRefused) as refused:
        parse(text, "settings.toml")
    told = [(problem.code, problem.where) for problem in refused.value.problems]
    assert (code, place) in told


def test_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigRefused) as refused:
        load(tmp_path / "none.toml")
    assert refused.value.code == "CONFIG_UNREADABLE"
