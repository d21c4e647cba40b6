"""What the helper's service, which runs as root, refuses even if its parser accepted it."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from tests.host.sandbox.helper.machines import Machine, machine
from tests.kit.golden import Golden

from nondum.host.core.feedback_state import State
from nondum.host.sandbox.cgroups.groups import NoTree
from nondum.host.sandbox.helper import requests, service
from nondum.host.sandbox.helper.device_nodes import Nodes
from nondum.host.sandbox.helper.lamps import Lamps
from nondum.host.sandbox.helper.requests import Request
from nondum.host.sandbox.helper.service import Service
from nondum.host.sandbox.helper.stop_key import PressesOfDevice
from nondum.sdk.errors import NondumError

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="making device nodes needs root")
SERVED = 65534
STICK = requests.Mount("sdb1", 7, "ext4", "read")


@pytest.fixture
def stick(tmp_path: Path) -> Machine:
    return machine(tmp_path)


@pytest.fixture
def root(stick: Machine, tmp_path: Path) -> Service:
    nodes = Nodes(tmp_path / "nodes", SERVED, sys=tmp_path / "sys")
    lamps = Lamps((), tmp_path / "lamps.json")
    return Service(SERVED, tmp_path / "mounts", stick.disks, nodes, NoTree(), lambda: lamps, no_key)


def no_key() -> PressesOfDevice:
    raise requests.refused("there is none")


def test_lamps_are_those_of_root_alone(stick: Machine, tmp_path: Path) -> None:
    lamp = tmp_path / "leds/ACT"
    lamp.mkdir(parents=True)
    for name, text in (("trigger", "[mmc0] none"), ("brightness", "0"), ("max_brightness", "9")):
        (lamp / name).write_text(text)
    names: list[str] = []
    nodes = Nodes(tmp_path / "nodes", SERVED, sys=tmp_path / "sys")

    def lamps() -> Lamps:
        return Lamps(tuple(names), tmp_path / "run/lamps.json", tmp_path / "leds")

    root = Service(SERVED, tmp_path / "mounts", stick.disks, nodes, NoTree(), lamps, no_key)
    root.serve(requests.ShowLamps(State.READY))
    assert (lamp / "brightness").read_text() == "0"
    names.append("ACT")
    root.serve(requests.ShowLamps(State.READY))
    assert (lamp / "brightness").read_text() == "9"
    root.serve(requests.EndLamps())
    assert (lamp / "trigger").read_text() == "mmc0"


def refused(root: Service, request: Request) -> str:
    with pytest.raises(NondumError) as error:
        root.serve(request)
    assert error.value.code == "HELPER_REFUSED"
    return error.value.problems[0].message


def test_nodes_without_a_component_are_not_made(root: Service, golden: Golden) -> None:
    why = refused(root, requests.PutNode("", "line", 188, 0, None))
    golden.check("a node of no component", why)


def test_drives_are_mounted_once(root: Service) -> None:
    (root.mounts / "sdb1-7").mkdir(parents=True)
    assert "mounted already" in refused(root, STICK)
    assert (root.mounts / "sdb1-7").is_dir()


def test_so_many_drives_are_mounted_and_no_more(root: Service, golden: Golden) -> None:
    for number in range(service.MOST_DRIVES):
        (root.mounts / str(number)).mkdir(parents=True)
    golden.check("another drive", refused(root, STICK), most=service.MOST_DRIVES)


def test_only_a_limited_number_of_cgroups_is_made(
    root: Service, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.setattr(service, "MOST_CGROUPS", 0)
    golden.check("another cgroup", refused(root, requests.MakeCgroup("a.1")), most=0)


@pytest.mark.parametrize("pid", [0, 1])
def test_processes_of_the_system_are_put_into_no_cgroup(
    root: Service, pid: int, golden: Golden
) -> None:
    golden.check("a foreign process", refused(root, requests.FillCgroup("a.1", pid)))


def test_processes_of_other_users_are_put_into_no_cgroup(root: Service, golden: Golden) -> None:
    somebody = subprocess.Popen(["sleep", "60"], user=SERVED - 1)
    served = subprocess.Popen(["sleep", "60"], user=SERVED)
    try:
        why = refused(root, requests.FillCgroup("a.1", somebody.pid))
        golden.check("a foreign process", why)
        root.serve(requests.FillCgroup("a.1", served.pid))
    finally:
        for process in (somebody, served):
            process.kill()
            process.wait()
