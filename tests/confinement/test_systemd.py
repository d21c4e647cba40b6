"""What systemd is asked to be around a worker, and what the warden takes from a daemon."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nondum.host.confinement import systemd, systemd_warden
from nondum.host.confinement.systemd import Machine, Request

STATE = Path("/var/lib/nondum")
PLACES = (STATE / "venvs",)
REQUEST = Request(
    component="talker",
    code=("/var/lib/nondum/venvs/org.example.talker/talker/lib/python3.11/site-packages",),
    scratch="/var/lib/nondum/scratch/org.example.talker/talker",
    permissions=(),
    has_devices=False,
    memory_mb=128,
    tasks=64,
    descriptors=256,
    scratch_mb=16,
    cpu_weight=100,
    processors=0.0,
)
MACHINE = Machine(Path("/usr/bin/python3"), ("boot", "dev", "etc", "usr", "var"), ("dialout",))


def properties(request: Request) -> set[str]:
    return set(systemd.properties(request, MACHINE))


def test_a_request_travels_whole() -> None:
    asked = replace(REQUEST, permissions=("audio", "network"), has_devices=True, processors=1.5)
    assert systemd.parse(asked.encode(), PLACES) == asked


@pytest.mark.parametrize(
    "lie",
    [
        pytest.param({"component": "../../etc"}, id="another name"),
        pytest.param({"component": "a b"}, id="a blank"),
        pytest.param({"code": ["/etc"]}, id="code from elsewhere"),
        pytest.param({"code": ["/var/lib/nondum/venvs/../../../../etc"]}, id="a way back"),
        pytest.param({"code": ["/var/lib/nondum/venvs"]}, id="everybody's code"),
        pytest.param({"code": ["/var/lib/nondum/venvs/a:/etc"]}, id="a second path"),
        pytest.param({"code": ["/var/lib/nondum/venvs/%h"]}, id="a specifier"),
        pytest.param({"code": "/etc"}, id="no list"),
        pytest.param({"scratch": "/usr"}, id="scratch over the system"),
        pytest.param({"scratch": "/proc/self"}, id="scratch over processes"),
        pytest.param({"scratch": "scratch"}, id="a path that begins nowhere"),
        pytest.param({"permissions": ["root"]}, id="a permission of its own"),
        pytest.param({"permissions": [["network"]]}, id="a list of lists"),
        pytest.param({"has_devices": 1}, id="almost true"),
        pytest.param({"memory_mb": 0}, id="no memory"),
        pytest.param({"tasks": "64\nUser=root"}, id="another line"),
        pytest.param({"processors": "1"}, id="processors in words"),
        pytest.param({"user": "root"}, id="another part"),
    ],
)
def test_a_warden_refuses(lie: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"."):
        systemd.parse(json.dumps({**asdict(REQUEST), **lie}).encode(), PLACES)


@pytest.mark.parametrize(
    ("lie", "words"),
    [
        ({"user": "root"}, "other parts"),
        ({"code": "/etc"}, "a list is expected"),
        ({"permissions": "network"}, "a list is expected"),
        ({"component": "a b"}, "no component"),
        ({"component": 7}, "expected"),
        ({"scratch": "scratch"}, "not a folder of a worker"),
        ({"code": ["/var/lib/nondum/other/a/b/c"]}, "code from elsewhere"),
        ({"scratch": "/usr/lib/nondum/scratch"}, "hide the system"),
        ({"permissions": ["root"]}, "no such permission"),
        ({"has_devices": 1}, "true or false"),
        ({"memory_mb": 0}, "no number that can be held to"),
        ({"tasks": 2**30 + 1}, "no number that can be held to"),
        ({"cpu_weight": 1.0}, "no number that can be held to"),
        ({"processors": 1}, "no number of processors"),
        ({"processors": -1.0}, "no number of processors"),
        ({"processors": 10_001.0}, "no number of processors"),
    ],
    ids=str,
)
def test_a_warden_says_what_it_refuses(lie: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        systemd.parse(json.dumps({**asdict(REQUEST), **lie}).encode(), PLACES)


def test_what_is_no_request_at_all_is_told() -> None:
    with pytest.raises(ValueError, match="brackets"):
        systemd.parse(b"[" * systemd.MAX_BYTES, PLACES)
    with pytest.raises(ValueError, match="other parts"):
        systemd.parse(b"[]", PLACES)


@given(st.binary(max_size=200) | st.just(b"[" * systemd.MAX_BYTES))
def test_garbage_is_no_request(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        systemd.parse(data, PLACES)


@given(
    st.sampled_from(sorted(asdict(REQUEST))),
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    ),
)
def test_one_wrong_part_is_refused_in_words(part: str, value: Any) -> None:
    body = {**asdict(REQUEST), part: value}
    try:
        systemd.parse(json.dumps(body).encode(), PLACES)
    except ValueError as error:
        assert str(error)


def test_a_link_to_elsewhere_is_no_code(tmp_path: Path) -> None:
    (tmp_path / "venvs").mkdir()
    (tmp_path / "venvs/etc").symlink_to("/etc")
    lie = replace(REQUEST, code=(str(tmp_path / "venvs/etc"),))
    with pytest.raises(ValueError, match="elsewhere"):
        systemd.parse(lie.encode(), [tmp_path / "venvs"])


def test_a_service_sees_no_more_than_it_needs() -> None:
    asked = properties(REQUEST)
    hidden = next(each for each in asked if each.startswith("TemporaryFileSystem=/boot"))
    assert hidden == "TemporaryFileSystem=/boot:ro /etc:ro /var:ro"
    assert {"PrivateNetwork=yes", "PrivateDevices=yes", "InaccessiblePaths=/sys"} <= asked
    assert {"DynamicUser=yes", "CapabilityBoundingSet=", "NoNewPrivileges=yes"} <= asked


def test_a_service_writes_to_memory_only() -> None:
    asked = properties(REQUEST)
    assert {"ProtectSystem=strict", "ReadOnlyPaths=/tmp /var/tmp"} <= asked
    sized = [each for each in asked if "mode=0777" in each or "mode=1777" in each]
    assert len(sized) == 2
    assert all("size=" in each for each in sized)


def test_a_service_is_limited() -> None:
    asked = properties(replace(REQUEST, processors=0.5))
    assert {"MemoryMax=128M", "MemorySwapMax=0", "TasksMax=64", "CPUQuota=50%"} <= asked


def test_only_the_granted_is_opened() -> None:
    asked = properties(replace(REQUEST, permissions=("network", "audio"), has_devices=True))
    assert "PrivateNetwork=yes" not in asked
    assert "PrivateDevices=yes" not in asked
    assert {
        "DevicePolicy=closed",
        "DeviceAllow=char-alsa rw",
        "DeviceAllow=char-188 rw",
    } <= asked
    assert not any(each.startswith("DeviceAllow=char-drm") for each in asked)


def test_devices_whose_driver_comes_later_are_opened_then() -> None:
    """systemd looks names of drivers up when a service starts, numbers never."""
    asked = properties(replace(REQUEST, has_devices=True))
    assert {f"DeviceAllow=char-{major} rw" for major in (188, 166, 189, 81)} <= asked


def test_both_ends_know_the_unit() -> None:
    unit = systemd.unit_of("talker", 4711)
    words = systemd.command(REQUEST, unit, MACHINE)
    assert "--unit=nondum-worker-talker-4711.service" in words
    assert "Slice=system.slice" in words


def test_a_warden_serves_its_user_only() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        ended = _warden(theirs, "--user", "nobody")
    assert ended.returncode == 1
    assert b"this user is not served" in ended.stderr


def test_a_warden_starts_nothing_without_descriptors() -> None:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with ours, theirs:
        ours.send(replace(REQUEST, code=()).encode())
        ended = _warden(theirs)
    assert b"a request brings three descriptors" in ended.stderr


def _warden(connection: socket.socket, *more: str) -> subprocess.CompletedProcess[bytes]:
    words = [sys.executable, "-m", systemd_warden.__name__, *more]
    return subprocess.run(
        words, stdin=connection.fileno(), capture_output=True, env=dict(os.environ), check=False
    )
