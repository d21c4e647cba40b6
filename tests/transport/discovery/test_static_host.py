"""Hosts as an integrator writes them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.sdk.errors import ConfigRefused
from nondum.transport.discovery.static_host import StaticHost


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("base", "base", 7410),
        ("base.lab.example:7500", "base.lab.example", 7500),
        ("10.0.0.7", "10.0.0.7", 7410),
        ("fd00::7", "fd00::7", 7410),
        ("[fe80::7%eth0]:7500", "fe80::7%eth0", 7500),
        ("[fd00::7]", "fd00::7", 7410),
    ],
)
def test_a_host_and_port_are_read(text: str, host: str, port: int) -> None:
    assert StaticHost.parse(text) == StaticHost(host, port)


@pytest.mark.parametrize(
    "text", ["", ":7410", "base:", "base:0", "base:65536", "base:http", "tcp://base", "a b", "[]:1"]
)
def test_what_is_no_host_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(ConfigRefused, match=r"peers\.static.*lab-3\.local"):
        StaticHost.parse(text)


@given(st.text())
def test_what_is_read_can_be_written_and_read_again(text: str) -> None:
    try:
        host = StaticHost.parse(text)
    except ConfigRefused as error:
        assert error.code == "STATIC_HOST"
    else:
        assert StaticHost.parse(str(host)) == host
