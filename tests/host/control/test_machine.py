"""How a machine is, read from files as the kernel writes them, and when people are warned."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from nondum.cli.render import size
from nondum.host.control.machine import (
    BUSY,
    HOT_C,
    LOW_MB,
    LOW_PERCENT,
    MARGIN_C,
    Battery,
    Disk,
    Load,
    Machine,
    Temperature,
    look,
)

POWER, THERMAL = "sys/class/power_supply", "sys/class/thermal"


def machine(root: Path, files: Mapping[str, str]) -> Machine:
    """A machine with these files below its root."""
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(f"{text}\n", encoding="utf-8")
    return look(root, 64, sys=root / "sys", proc=root / "proc")


def battery(name: str, **files: str) -> dict[str, str]:
    return {f"{POWER}/{name}/{key}": text for key, text in {"type": "Battery", **files}.items()}


def zone(number: int, **files: str) -> dict[str, str]:
    return {f"{THERMAL}/thermal_zone{number}/{key}": text for key, text in files.items()}


def test_what_is_not_there_is_not_told(tmp_path: Path) -> None:
    found = machine(tmp_path, {})
    assert (found.batteries, found.temperatures, found.load) == ((), (), None)
    assert look(tmp_path / "gone", 64, sys=tmp_path, proc=tmp_path) == Machine()


def test_a_battery_says_how_full_it_is_and_what_it_does(tmp_path: Path) -> None:
    files = battery("BAT0", capacity="81", status="Discharging", present="1")
    assert machine(tmp_path, files).batteries == (Battery("BAT0", 81, "discharging"),)


@pytest.mark.parametrize(
    ("files", "percent"),
    [
        ({"energy_now": "30", "energy_full": "40"}, 75),
        ({"charge_now": "10", "charge_full": "40"}, 25),
        ({"charge_now": "10", "charge_full": "0"}, None),
        ({"capacity": "130"}, 100),
        ({"capacity": "much"}, None),
        ({}, None),
    ],
    ids=["energy", "charge", "no full charge", "too much", "no number", "nothing"],
)
def test_how_full_a_battery_is_is_worked_out(
    tmp_path: Path, files: Mapping[str, str], percent: int | None
) -> None:
    assert machine(tmp_path, battery("B", **files)).batteries == (Battery("B", percent, "unknown"),)


def test_what_the_machine_does_not_run_on_is_no_battery_of_its(tmp_path: Path) -> None:
    files = {
        **battery("mouse", capacity="5", scope="Device"),
        **battery("empty-bay", capacity="0", present="0"),
        **battery("AC", type="Mains"),
    }
    assert machine(tmp_path, files).batteries == ()


def test_a_zone_says_how_hot_it_is_and_what_it_can_take(tmp_path: Path) -> None:
    files = zone(
        0,
        type="cpu-thermal",
        temp="47500",
        trip_point_0_type="passive",
        trip_point_0_temp="70000",
        trip_point_1_type="critical",
        trip_point_1_temp="110000",
        trip_point_2_type="hot",
        trip_point_2_temp="95000",
    )
    assert machine(tmp_path, files).temperatures == (Temperature("cpu-thermal", 47.5, 95.0),)


@pytest.mark.parametrize("temp", ["-274000", "2147483647", "", "warm"])
def test_a_sensor_that_is_broken_is_not_told(tmp_path: Path, temp: str) -> None:
    files = {
        **zone(0, type="x", temp=temp),
        **zone(1, temp="20000"),
        f"{THERMAL}/cooling0/temp": "1",
    }
    assert machine(tmp_path, files).temperatures == (Temperature("thermal_zone1", 20.0, None),)


def test_load_is_told_beside_the_processors(tmp_path: Path) -> None:
    load = machine(tmp_path, {"proc/loadavg": "0.42 1.50 2.00 3/512 4242"}).load
    assert load is not None
    assert (load.one_min, load.five_min, load.fifteen_min) == (0.42, 1.5, 2.0)
    assert load.processors >= 1
    assert machine(tmp_path, {"proc/loadavg": "much"}).load is None


def test_the_disk_of_the_state_is_told_with_what_is_kept_free(tmp_path: Path) -> None:
    disk = machine(tmp_path, {}).disk
    assert disk is not None
    assert (disk.path, disk.reserve_mb) == (str(tmp_path), 64)
    assert 0 <= disk.free_mb <= disk.size_mb


def with_battery(percent: int | None, state: str = "discharging") -> Machine:
    return Machine(batteries=(Battery("B", percent, state),))


def with_free(free_mb: int) -> Machine:
    return Machine(disk=Disk("/state", free_mb, 10_000, 64))


def with_zone(celsius: float, limit: float | None = None) -> Machine:
    return Machine(temperatures=(Temperature("cpu", celsius, limit),))


def with_load(five_min: float) -> Machine:
    return Machine(load=Load(0.0, five_min, 0.0, 2))


FULL_AND_LOW = Machine(batteries=(Battery("A", 90, "discharging"), Battery("B", 1, "discharging")))


@pytest.mark.parametrize(
    ("well", "bad"),
    [
        (with_battery(LOW_PERCENT + 1), with_battery(LOW_PERCENT)),
        (with_battery(5, "charging"), with_battery(5, "not charging")),
        (with_battery(None), with_battery(0, "unknown")),
        (FULL_AND_LOW, with_battery(1)),
        (with_free(64 + LOW_MB), with_free(64 + LOW_MB - 1)),
        (with_free(65 + LOW_MB), with_free(64)),
        (with_zone(HOT_C - 1), with_zone(HOT_C)),
        (with_zone(HOT_C - 1, limit=HOT_C + MARGIN_C), with_zone(60.0, limit=60 + MARGIN_C)),
        (with_load(2 * BUSY), with_load(2 * BUSY + 0.1)),
    ],
    ids=[
        *("battery", "charging", "unknown", "two batteries", "little disk", "full disk"),
        *("hot", "limit", "load"),
    ],
)
def test_people_are_warned_when_it_is_bad_and_not_before(well: Machine, bad: Machine) -> None:
    assert len(list(bad.warnings())) == 1
    assert not list(well.warnings())


def test_small_disk_that_is_nearly_empty_is_not_called_full() -> None:
    """What is told is what the reserve leaves, in the unit of the status line."""
    (told,) = Machine(disk=Disk("/state", 188, 200, 64)).warnings()
    assert all(amount in told for amount in ("124 MB", "188 MB", "64 MB"))
    assert "full" not in told
    assert size(188 << 20) == "188.0 MB"


def test_views_carry_all_of_it() -> None:
    told = with_battery(3).to_dict()
    assert told["batteries"] == [{"name": "B", "percent": 3, "state": "discharging"}]
    assert (told["disk"], told["temperatures"], told["load"]) == (None, [], None)
    assert len(told["warnings"]) == 1
