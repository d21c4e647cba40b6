"""`nondum devices`: of a device in use, of one that is not, and of one that is left alone."""

from __future__ import annotations

import os
import pty
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from demo import slots
from tests.daemon.plugins import gauge
from tests.kit.command_line import nondum
from tests.kit.golden import Golden
from tests.kit.payloads import make_payload
from tests.kit.running_host import RunningHost, running
from tests.kit.until import until

SERVING = {"ID_MODEL": "Gauge", "ID_VENDOR_ID": "0403", "ID_MODEL_ID": "6001"}
OTHER = {"ID_MODEL": "Knob", "SUBSYSTEM": "hidraw"}
KEYS = {"ID_MODEL": "Keys", "SUBSYSTEM": "input", "ID_INPUT_KEYBOARD": "1"}


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningHost]:
    line, other = pty.openpty()
    with running(tmp_path_factory.mktemp("host")) as daemon:
        for name, properties in (("line", SERVING), ("knob", OTHER), ("keys", KEYS)):
            slots.plug(daemon.devices, name, os.ttyname(other), properties)
        daemon.plug(daemon.drive("gauge", gauge()))
        daemon.until(
            "the gauge is ready", lambda view: any(row["ready"] for row in view["components"])
        )
        yield daemon
    os.close(line)
    os.close(other)


def rows(daemon: RunningHost, *arguments: str) -> list[list[str]]:
    shown = daemon.run("devices", *arguments).ok().out
    return [line.split("  ") for line in shown.splitlines()]


def test_it_is_told_who_has_what_and_what_is_left_alone(
    daemon: RunningHost, golden: Golden
) -> None:
    users = {row[0]: row[-1].strip() for row in rows(daemon)[1:]}
    assert users.keys() == {"keys", "knob", "line"}
    assert users["line"] == "gauge (gauge)"
    golden.check("a keyboard is left alone", users["keys"])
    golden.check("no component uses a device", users["knob"])


def test_data_have_all_that_is_known(daemon: RunningHost) -> None:
    shown = {row["device"]: row for row in daemon.run("devices", "--json").ok().json}
    line = shown["line"]
    assert (line["component"], line["need"], line["vendor"]) == ("gauge", "gauge", "0403")
    assert line["identity"].endswith("0403:6001 at line")
    assert line["first_s"] <= line["since_s"]
    assert [node["node"] for node in line["nodes"]] == [line["node"]]


def test_why_tells_every_rule_and_what_was_found(daemon: RunningHost, golden: Golden) -> None:
    said = daemon.run("devices", "--why", "knob").ok().out
    golden.check_line("why: no component uses it", said)
    golden.check_line("why: a rule does not match", said)
    assert "        ✗ ID_MODEL = Gauge: Knob\n" in said
    assert "✓ ID_MODEL = Gauge: Gauge" in daemon.run("devices", "--why", "line").ok().out
    kept = daemon.run("devices", "--why", "keys").ok().out
    golden.check_line("why: a keyboard is left alone", kept)


def slots_told(daemon: RunningHost) -> list[str]:
    return [told for told in daemon.ask("status")["warnings"] if "SLOT" in told]


def test_slot_that_leads_nowhere_is_told_by_devices_and_status(daemon: RunningHost) -> None:
    link = daemon.devices / "lamp.toml"
    link.symlink_to("lamp.toml")
    try:
        until("the link is told", lambda: len(slots_told(daemon)) == 1)
        assert f"SLOT_DANGLING {link}" in slots_told(daemon)[0]
        ran = daemon.run("devices")
        assert (ran.code, f"warning: SLOT_DANGLING {link}" in ran.err) == (0, True)
        daemon.run("devices", "--json").ok()
    finally:
        link.unlink()
    until("it is told no more", lambda: not slots_told(daemon))


def test_device_may_be_named_by_its_node(daemon: RunningHost) -> None:
    ((line, *_),) = [row for row in rows(daemon) if row[0] == "line"]
    (shown,) = daemon.run("devices", line, "--json").ok().json
    name = Path(shown["node"]).name
    found = daemon.run("devices", name, "--json").ok().json
    assert "line" in {row["device"] for row in found}


def test_device_that_is_none_is_refused(daemon: RunningHost) -> None:
    daemon.run("devices", "nothing").refused(2, "DEVICE_UNKNOWN").refused(2, "keys, knob, line")


def test_software_for_a_device_without_is_named(daemon: RunningHost, tmp_path: Path) -> None:
    folder = tmp_path / "shelf"
    make_payload(folder, gauge("meter"), payload_id="org.example.meter")
    slots.plug(daemon.devices, "second", "/dev/null", SERVING)
    try:
        daemon.until("the second one is shown", lambda _: len(rows(daemon)) == 5)
        said = daemon.run("devices", "--wheelhouse", folder).ok().out
    finally:
        slots.unplug(daemon.devices, "second")
    assert re.search(r"\bsecond\b.*\bGauge\b.*\borg\.example\.meter 1\.0\b", said)
    daemon.until("the second one is gone", lambda _: len(rows(daemon)) == 4)
    gone = daemon.run("devices", "--all").ok().out
    assert "at second" in gone


def test_without_a_daemon_there_is_one_sentence(tmp_path: Path) -> None:
    nondum("devices", NONDUM_CONTROL=str(tmp_path / "none.sock")).refused(4, "HOST_UNREACHABLE")
