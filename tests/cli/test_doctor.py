"""`nondum doctor network`, as a person reads it."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

import pytest
from tests.kit.command_line import nondum
from tests.kit.golden import Golden
from tests.kit.running_host import running


def test_every_finding_has_its_place_in_the_table() -> None:
    done = nondum("doctor", "network")
    assert done.out.splitlines()[0].split() == ["RESULT", "CHECK", "INTERFACE", "DETAIL"]
    assert "firewall" in done.out
    assert all(port in done.out for port in ("5353", "7410"))


def test_what_is_bad_is_told_with_its_own_exit_code() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = nondum("doctor", "network", "--json", "--port", str(port))
    told = json.loads(done.out)
    (found,) = (one for one in told["findings"] if one["check"] == f"TCP port {port}")
    assert (done.code, told["ok"], found["result"]) == (3, False, "bad")
    assert "peers.listen" in found["fix"]


@pytest.mark.skipif(os.geteuid() != 0, reason="cgroups are root's here")
def test_what_workers_are_limited_in_is_told() -> None:
    told = json.loads(nondum("doctor", "limits", "--json").ok().out)
    assert told["ok"]
    assert told["cgroups"] in ("v1", "v2")
    assert all(limit["held"] for limit in told["limits"])
    assert "memory  yes" in nondum("doctor", "limits").out


def test_every_level_of_confinement_is_tried() -> None:
    done = nondum("doctor", "confinement").ok()
    assert done.out.splitlines()[0].split() == ["LEVEL", "MECHANISM", "AVAILABLE", "REASON"]
    told = json.loads(nondum("doctor", "confinement", "--json").ok().out)
    available = {row["level"]: row["available"] for row in told["levels"]}
    assert told["ok"]
    need = "tests need bubblewrap and Landlock"
    assert available == {"sandboxed": True, "restricted": True}, need
    assert all(row["available"] or (row["reason"] and row["fix"]) for row in told["levels"])


def test_it_lists_the_owner_of_each_disk() -> None:
    """None of a machine without USB disks is a drive."""
    told = json.loads(nondum("doctor", "disks", "--json").ok().out)
    assert all(row["whose"] == "host" and row["why"] for row in told if not row["usb"])
    shown = nondum("doctor", "disks").ok().out
    # Other tests attach and detach loop devices between the two looks.
    stay = [row["disk"] for row in told if not row["disk"].startswith("loop")]
    assert all(disk in shown for disk in stay)


def test_everything_is_looked_at_for_who_asks_for_nothing_in_particular(
    tmp_path: Path, golden: Golden
) -> None:
    """And bad findings have their own exit code."""
    with running(tmp_path, name="panther") as host:
        told = nondum("doctor", "--user", "--config", host.config, "--json")
        found = {one["check"]: one for one in told.json["findings"]}
        is_bad = any(one["result"] == "bad" for one in found.values())
        assert (told.code, told.json["ok"]) == ((3, False) if is_bad else (0, True))
        golden.check("the configuration is right", found["config"]["detail"], file=host.config)
        assert found["daemon"]["detail"].startswith("panther answers")
        assert all(bool(one["fix"]) or one["result"] == "ok" for one in told.json["findings"])
    host.config.write_text("[hots]\n", encoding="utf-8")
    shown = nondum("doctor", "--user", "--config", host.config)
    assert shown.code == 3
    assert shown.out.splitlines()[0].split() == ["RESULT", "CHECK", "SUBJECT", "DETAIL"]
    golden.check_line("the configuration is wrong", shown.out)
