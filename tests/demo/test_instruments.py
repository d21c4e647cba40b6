"""Both drivers against both emulators as programs: bytes only, scored from the truth afterwards."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from demo.emulators.pose import Mount
from demo.instruments import EMULATORS, Instruments, switched_on
from demo.pointing import HELD_S, Score
from demo.scenario import random_scenario
from tests.kit.until import until

from nondum.sdk.bench import WorkerFactory

TARGET = {"t": "radiation-source", "h": "robot"}
STRONG_BQ = 4e10
"""Found at once, where finding it is not the point."""
AT_HOME = Mount((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def run(
    worker: WorkerFactory,
    instruments: Instruments,
    *,
    camera: Mount,
    pointer: Mount,
) -> tuple[Score, Any]:
    """Localise and point with the mounts that a person entered; the score, and the call."""
    sensor = worker(
        "nondum_compton_camera.plugin",
        devices={"list-mode": instruments.nodes["camera"]},
        component="rays",
    )
    head = worker(
        "nondum_pan_tilt_unit.plugin",
        devices={"head": instruments.nodes["head"], "laser-relay": instruments.nodes["relay"]},
        component="arrow",
        mounts={
            "laser-pointer": (pointer.xyz, pointer.rpy),
            sensor.objects["gamma-eye"]: (camera.xyz, camera.rpy),
        },
    )
    sensor.behave("localise", u="gamma-eye", **TARGET).assert_succeeded(timeout_s=60)
    value = sensor.facts["bearing-known", "radiation-source", "robot"]
    assert value is not None
    head.set_value("bearing-known", "radiation-source", "robot", value=value)
    call = head.behave("point", u="laser-pointer", **TARGET).wait_established(timeout_s=30)
    return instruments.score(instruments.switched(on=True) + HELD_S + 0.2), call


@pytest.mark.parametrize(
    "number", [1, *(pytest.param(n, marks=pytest.mark.long("demonstrations")) for n in (2, 3))]
)
def test_the_laser_comes_to_rest_on_the_source(
    worker: WorkerFactory, tmp_path: Path, number: int
) -> None:
    scenario = random_scenario(number)
    with switched_on(scenario, tmp_path) as instruments:
        found, call = run(worker, instruments, camera=scenario.camera, pointer=scenario.pointer)
        assert found.is_reached, str(found)
        call.halt()
        instruments.switched(on=False)


@pytest.mark.parametrize(
    "forgotten",
    ["camera", "pointer", pytest.param("both", marks=pytest.mark.long("demonstrations"))],
)
def test_a_mount_left_out_fails(worker: WorkerFactory, tmp_path: Path, forgotten: str) -> None:
    scenario = replace(random_scenario(2), activity_bq=STRONG_BQ)
    mounts = {"camera": scenario.camera, "pointer": scenario.pointer}
    mounts |= {name: AT_HOME for name in mounts if forgotten in (name, "both")}
    with switched_on(scenario, tmp_path) as instruments:
        found, _ = run(worker, instruments, **mounts)
    assert found.lit
    assert found.angle_rad > math.radians(10)


def test_a_seized_head_fails_though_the_driver_cannot_know(
    worker: WorkerFactory, tmp_path: Path
) -> None:
    scenario = replace(random_scenario(1), seized=True, activity_bq=STRONG_BQ)
    with switched_on(scenario, tmp_path) as instruments:
        found, call = run(worker, instruments, camera=scenario.camera, pointer=scenario.pointer)
        assert call.state == "established"
    assert not found.is_reached


def test_instruments_are_plugged_in_and_out(tmp_path: Path) -> None:
    folder = tmp_path / "slots"
    folder.mkdir()
    with switched_on(random_scenario(1), tmp_path) as instruments:
        assert len(set(instruments.nodes.values())) == 3
        instruments.plug(folder)
        assert sorted(file.stem for file in folder.iterdir()) == ["camera", "head", "relay"]
        instruments.unplug(folder)
        assert not list(folder.iterdir())


def test_emulators_end_with_who_started_them(tmp_path: Path) -> None:
    random_scenario(1).write(tmp_path / "truth.json")
    script = (
        "import subprocess, sys;"
        "p = subprocess.Popen([sys.executable, *sys.argv[1:]], stdout=subprocess.PIPE, text=True);"
        "print(p.pid, p.stdout.readline().strip())"
    )
    emulator, truth = EMULATORS / "compton_emulator.py", tmp_path / "truth.json"
    ran = subprocess.run(
        [sys.executable, "-c", script, emulator, "--scenario", truth],
        capture_output=True,
        text=True,
        check=True,
    )
    pid, terminal = ran.stdout.split()
    assert terminal.startswith("/dev/pts/")
    until("the emulator to end", lambda: not is_running(pid))


def is_running(pid: str) -> bool:
    try:
        status = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"
