"""Where the demonstration's hosts are: what they are told of each other."""

from __future__ import annotations

from pathlib import Path

from demo.search.sites import Lan, Loopback, site

from nondum.host.config.host_config import HostConfig, PeersSection
from nondum.host.config.parsing import parse

NAMES = ("rover", "mule", "scout")


def peers(text: str) -> PeersSection:
    return parse(text, "host.toml", HostConfig()).peers


def test_hosts_on_loopback_are_configured_with_all_ports_but_their_own(tmp_path: Path) -> None:
    with site(tmp_path, NAMES, is_loopback=True) as where:
        assert isinstance(where, Loopback)
        found = {name: peers(where.prepare(name, tmp_path / name)) for name in NAMES}
    listen = {name: section.listen[0].removeprefix("tcp://") for name, section in found.items()}
    assert len({*listen.values()}) == len(NAMES)
    for name, section in found.items():
        assert {*section.static} == {port for other, port in listen.items() if other != name}
        assert (section.enabled, section.development, section.discover) == (True, True, False)
    assert "no keys" in where.told


def test_hosts_on_a_network_are_told_nothing_but_to_look(tmp_path: Path) -> None:
    assert "development mode" not in Lan.told
    with site(tmp_path, NAMES, is_loopback=False) as where:
        if isinstance(where, Loopback):  # no root: there are no namespaces to be had
            assert where.command_prefix("rover") == ()
            return
        section = peers(where.prepare("rover", tmp_path / "rover"))
        assert (section.development, section.discover, section.static) == (False, True, ())
        assert where.command_prefix("rover") != where.command_prefix("mule")
