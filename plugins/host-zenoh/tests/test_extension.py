"""The host finds the extension, which loads Zenoh only where a router is named.

What its fleets do is tested beside what all fleets do: tests/transport/fleet of the checkout.
"""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import entry_points

import pytest

from nondum.host.config.host_config import HostConfig
from nondum.host.config.parsing import parse
from nondum_host_zenoh import extension

ASKED = """
import sys
from nondum.host.config.host_config import HostConfig
from nondum_host_zenoh.extension import fleets
assert not fleets(HostConfig())
print(*(name for name in sys.modules if name.split(".")[0] == "zenoh"))
print(*(name for name in sys.modules if name.startswith("nondum.transport")))
"""


def test_extension_is_found_by_its_entry_point() -> None:
    [found] = entry_points(group="nondum.host", name="zenoh")
    assert found.load() is extension


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("", []),
        ('[router]\nendpoints = ["tls/router.example:7447"]\n', ["zenoh"]),
        ('[router]\nfleet = "yard"\n', []),
    ],
)
def test_router_is_used_where_one_is_named(text: str, names: list[str]) -> None:
    assert list(extension.fleets(parse(text, "host.toml", HostConfig()))) == names


def test_host_without_a_router_loads_nothing_for_one() -> None:
    command = [sys.executable, "-c", ASKED]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert said == "\n\n"
