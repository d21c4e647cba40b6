"""A payload that cannot run where it is plugged in runs on a peer that can, for as long."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest
from demo.ports import free_port
from demo.robot import nondum
from tests.daemon.neighbours import UNCONFINED, beacon, until_peer, until_shared, written
from tests.daemon.plugins import talker
from tests.kit.disk_images import image
from tests.kit.golden import Golden
from tests.kit.loop_devices import attached, detach
from tests.kit.payloads import Part
from tests.kit.running_host import DAEMON, RunningHost
from tests.kit.traces import until_unmounted
from tests.kit.until import until

from nondum.sdk.errors import NondumError

pytestmark = pytest.mark.daemon

PYTHON, DASH_M, *DAEMON_MODULE = DAEMON
OTHER_MACHINE = (PYTHON, DASH_M, "tests.kit.other_machine")
ROVER_IS_OTHER = {"rover": (*OTHER_MACHINE, *DAEMON_MODULE)}
NOTHING_ELSE: Mapping[str, Sequence[str]] = {}


@contextmanager
def hosts(
    work: Path,
    *names: str,
    programs: Mapping[str, Sequence[str]] = NOTHING_ELSE,
    unsigned: Sequence[str] | None = None,
    more: str = "",
) -> Iterator[list[RunningHost]]:
    """Peers in development mode. `programs` are the daemons of some; if `unsigned` names some, only
    those take unsigned payloads."""
    ports = {name: free_port() for name in names}
    with ExitStack() as stack:
        made = []
        for name in names:
            others = [f"127.0.0.1:{port}" for other, port in ports.items() if other != name]
            (work / name).mkdir(parents=True)
            host = RunningHost(
                work / name,
                name=name,
                more=f"{UNCONFINED}[peers]\nenabled = true\ndevelopment = true\n"
                f"discover = false\n{more}\n"
                f'listen = ["tcp://127.0.0.1:{ports[name]}"]\nstatic = {others}\n',
                program=programs.get(name, DAEMON),
            )
            if unsigned is not None and name not in unsigned:
                config = host.work / "host.toml"
                text = config.read_text(encoding="utf-8")
                config.write_text(text.replace("allow_unsigned = true", ""), encoding="utf-8")
            stack.callback(host.stop)
            host.start()
            made.append(host)
        for host in made:
            for other in names:
                if other != host.name:
                    until_peer(host, other)
        yield made


def test_what_does_not_fit_here_runs_on_a_peer(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with hosts(tmp_path, "rover", "mule", programs=ROVER_IS_OTHER) as (rover, mule):
        slot = rover.plug(rover.drive("light", beacon(log)))
        mule.until_step("light", "active")
        until_shared(rover, "beacon@mule")
        rover.until_told("org.example.light runs on mule, not here: needs wheels for")
        mule.until_told("org.example.light runs here for rover")
        head, line, *_ = nondum("--control", rover.control, "place").splitlines()
        assert head.split() == ["PAYLOAD", "VERSION", "STATE", "ON", "WHY"]
        assert line.split()[:4] == ["org.example.light", "1.0", "active", "mule"]
        head, line, *_ = nondum("--control", mule.control, "place").splitlines()
        assert line.split()[:5] == ["org.example.light", "1.0", "active", "mule", "rover"]
        (row,) = rover.ask("status")["payloads"]
        assert (row["state"], row["place"]) == ("refused", "mule")
        assert rover.ask("status")["state"] == "ready"
        given = rover.ask("goal", words="blink")
        rover.until_goal(given["id"], "reached")
        assert written(log) == ["blink"]
        rover.pull(slot)
        mule.until_gone("light")
        rover.until_gone("light")
        assert not list((mule.state / "placed").iterdir())
        assert not list((rover.state / "handover").iterdir())


def bulky(log: Path, megabytes: int) -> Part:
    """A beacon that takes a while to send."""
    noise = Random(7).randbytes(megabytes << 19).hex()
    return replace(beacon(log), files={"test_beacon_noise.py": f'NOISE = "{noise}"\n'})


def placed(host: RunningHost, name: str) -> dict[str, Any]:
    """What a host says of where one of its payloads is."""
    rows = [row for row in host.ask("places") if row["payload"] == f"org.example.{name}"]
    return dict(rows[0]) if rows else {}


def until_place(host: RunningHost, name: str, **wanted: Any) -> dict[str, Any]:
    """Wait until a host says so of where a payload is; views do not show how far it is."""

    def found() -> dict[str, Any] | None:
        row = placed(host, name)
        return row if wanted.items() <= row.items() else None

    row = until(f"{name}: {wanted}", found, evidence=lambda: placed(host, name))
    assert row is not None
    return row


def test_death_of_its_host_withdraws_a_payload(tmp_path: Path) -> None:
    with hosts(tmp_path, "rover", "mule", programs=ROVER_IS_OTHER) as (rover, mule):
        rover.plug(rover.drive("light", beacon(tmp_path / "log")))
        mule.until_step("light", "active")
        rover.kill()
        mule.until_gone("light")
        mule.until_told("org.example.light is withdrawn: the host that handed it over ended that")
        assert not list((mule.state / "placed").iterdir())
        rover.start()
        mule.until_step("light", "active")


def test_next_host_takes_what_one_dies_of(tmp_path: Path) -> None:
    with hosts(tmp_path, "rover", "mule", "tower", programs=ROVER_IS_OTHER) as made:
        rover, *others = made
        rover.plug(rover.drive("light", bulky(tmp_path / "log", 40)))
        row = until_place(rover, "light", state="fetching")
        first = next(host for host in others if host.name == row["host"])
        (second,) = (host for host in others if host is not first)
        first.kill()
        second.until_step("light", "active")
        until_shared(rover, f"beacon@{second.name}")
        assert until_place(rover, "light", state="active")["host"] == second.name
        second.kill()
        rover.until_told(f"org.example.light does not run on {second.name} any more")
        first.start()
        until_shared(rover, f"beacon@{first.name}")
        assert len(list((first.state / "placed").iterdir())) == 1, "what was half fetched is gone"


def test_host_that_was_out_of_reach_is_asked_again(tmp_path: Path) -> None:
    with hosts(tmp_path, "rover", "mule", programs=ROVER_IS_OTHER) as (rover, mule):
        rover.plug(rover.drive("light", beacon(tmp_path / "log")))
        until_place(rover, "light", state="active")
        os.kill(mule.pid, signal.SIGSTOP)
        rover.until_told("org.example.light does not run on mule any more")
        os.kill(mule.pid, signal.SIGCONT)
        mule.until_told("org.example.light is withdrawn")
        until_place(rover, "light", state="active")
        until_shared(rover, "beacon@mule")
        assert len(list((mule.state / "placed").iterdir())) == 1


def test_rules_of_the_other_host_hold_there(tmp_path: Path, golden: Golden) -> None:
    with hosts(tmp_path, "rover", "mule", programs=ROVER_IS_OTHER, unsigned=["rover"]) as made:
        rover, mule = made
        rover.plug(rover.drive("light", beacon(tmp_path / "log")))
        told = rover.until_told("no host takes org.example.light")
        golden.check("the other host does not take it", told)
        row = placed(rover, "light")
        golden.check("state: no host takes it", row["state"])
        assert list(row["declined"]) == ["mule"]
        assert not mule.view["payloads"]
        assert not list((mule.state / "placed").iterdir())
        assert all(row["event"] != "DriveInserted" for row in mule.journal())


def test_host_that_takes_nothing_is_not_asked(tmp_path: Path) -> None:
    with hosts(tmp_path, "rover", "mule", programs=ROVER_IS_OTHER, more="place = false") as made:
        rover, mule = made
        rover.plug(rover.drive("light", beacon(tmp_path / "log")))
        rover.until_step("light", "refused")
        assert placed(rover, "light") == {}
        assert not mule.view["payloads"]
        with pytest.raises(NondumError) as refused:
            rover.ask("place", payload="org.example.light", host="mule")
        assert refused.value.code == "PLACE_OFF"


def test_person_says_where_a_payload_runs(tmp_path: Path, golden: Golden) -> None:
    with hosts(tmp_path, "rover", "mule") as (rover, mule):
        slot = rover.plug(rover.drive("light", beacon(tmp_path / "log")))
        rover.until_step("light", "active")
        said = nondum("--control", rover.control, "place", "org.example.light", "mule")
        golden.check("a person places a payload", said)
        until_shared(rover, "beacon@mule")
        row = rover.until_step("light", "refused")
        assert row["codes"] == ["PLACED_ELSEWHERE"]
        assert rover.component("beacon") is None
        rover.pull(slot)
        mule.until_gone("light")
        rover.until_gone("light")
        (row,) = rover.ask("places")
        assert row["pinned"] == "mule"
        golden.check("state: not plugged in", row["state"])
        rover.stop()
        rover.start()
        rover.plug(rover.work / "drives" / "light")
        until_shared(rover, "beacon@mule")
        assert ("ComponentsProbed", "org.example.light") not in happened_last(rover)
        nondum("--control", rover.control, "place", "org.example.light", "--here")
        rover.until_component("beacon", "ready")
        mule.until_gone("light")
        assert rover.ask("places") == []


def happened_last(host: RunningHost) -> list[tuple[str, str]]:
    """What the journal says since the daemon was last started."""
    rows = host.journal()
    boot = rows[-1]["boot"]
    starts = [n for n, row in enumerate(rows) if row["event"] == "HostStarted"]
    assert boot == rows[starts[-1]]["boot"]
    return [(row["event"], row["subject"]) for row in rows[starts[-1] :]]


def test_what_cannot_be_placed_is_said(tmp_path: Path) -> None:
    with hosts(tmp_path, "rover", "mule") as (rover, _):
        rover.bring("light", beacon(tmp_path / "log"))
        for arguments, code in (
            ({"payload": "org.example.lihgt", "host": "mule"}, "PAYLOAD_UNKNOWN"),
            ({"payload": "org.example.light", "host": "mul"}, "PEER_UNKNOWN"),
            ({"payload": "org.example.nothing"}, "PAYLOAD_UNKNOWN"),
        ):
            with pytest.raises(NondumError) as refused:
                rover.ask("place", **arguments)
            assert refused.value.code == code
        assert rover.ask("places") == []


@pytest.mark.skipif(
    os.geteuid() != 0 or not Path("/dev/loop-control").exists(), reason="loop devices need root"
)
def test_stick_that_was_let_go_is_mounted_again_to_hand_it_over(tmp_path: Path) -> None:
    loops = ("tests.daemon.loop_daemon", str(tmp_path))
    programs = {"rover": (*OTHER_MACHINE, *loops)}
    with hosts(tmp_path, "rover", "mule", programs=programs, more="place = true") as (rover, mule):
        before = rover.traces()
        mule.stop()
        with attached(image(tmp_path, talker())) as node:
            rover.until_step("lamp", "refused")
            rover.until("let go", lambda v: {d["state"] for d in v["drives"]} == {"idle"})
            assert not rover.traces().mounts
            mule.start()
            mule.until_step("lamp", "active")
            until_unmounted(rover.state)
            detach(node)
            mule.until_gone("lamp")
        rover.until_gone("lamp")
        assert rover.traces() == before
