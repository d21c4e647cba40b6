"""The plugin over the host's protocol, with a simulated receiver on a pseudo-terminal."""

from __future__ import annotations

import threading
from typing import Any

import pytest
from simulated_receiver import NO_FIX, SimulatedReceiver, gga, gsa, gsv, rmc

from nondum.sdk import GpsFix, NondumError
from nondum.sdk.serial_line import SerialLine

PLUGIN = "nondum_gps.plugin:Gps"
KNOWN = ("position-known", "robot")
ASK = {"u": "receiver", "h": "robot"}
SOON_S = 0.2


def started(worker: Any, receiver: SimulatedReceiver, **settings: Any) -> Any:
    return worker(PLUGIN, devices={"receiver": receiver.node}, settings=settings)


def is_forgotten(bench: Any) -> None:
    bench.wait_until(lambda: KNOWN not in bench.facts, "that it is forgotten")


def test_fix_is_known_and_sent(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver)
    receiver.says(gsa(3), gga(), rmc())
    fix: Any = bench.wait_fact(*KNOWN)
    assert isinstance(fix, GpsFix)
    assert (fix.latitude_deg, fix.longitude_deg) == pytest.approx((51.05, 13.74))
    assert fix.altitude_m == pytest.approx(162.8)
    assert fix.covariance is not None
    assert fix.header.frame_id == bench.objects["receiver"]
    assert bench.read("fix").latitude_deg == fix.latitude_deg
    assert bench.flowing == {bench.objects["fix"]}


def test_value_of_the_fact_is_the_newest_fix(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver)
    receiver.says(gga())
    bench.wait_fact(*KNOWN)
    receiver.says(gga(-33.5, -70.25))
    bench.wait_until(lambda: bench.facts[KNOWN].latitude_deg < 0, "the second fix")
    assert bench.facts[KNOWN].longitude_deg == pytest.approx(-70.25)


def test_without_a_fix_it_sends_that_there_is_none(
    worker: Any, receiver: SimulatedReceiver
) -> None:
    bench = started(worker, receiver)
    receiver.says(NO_FIX)
    assert bench.read("fix").status == "none"
    assert KNOWN not in bench.facts


def test_fix_that_is_lost_is_forgotten_and_comes_again(
    worker: Any, receiver: SimulatedReceiver
) -> None:
    bench = started(worker, receiver, lost_after_s=SOON_S)
    receiver.says(gga())
    bench.wait_fact(*KNOWN)
    receiver.says()
    is_forgotten(bench)  # though no sentence says so: the line has fallen silent
    bench.wait_until(lambda: bench.logs, "why")
    assert "GPS_SILENT" in bench.logs[-1][1]
    receiver.says(gga())
    bench.wait_fact(*KNOWN)


def test_fix_that_is_lost_for_a_moment_is_kept(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver, lost_after_s=600)
    receiver.says(gga())
    bench.wait_fact(*KNOWN)
    receiver.says(NO_FIX)
    while bench.read("fix").status != "none":
        pass
    assert KNOWN in bench.facts


def test_receiver_that_is_pulled_is_forgotten_and_may_come_again(
    worker: Any, receiver: SimulatedReceiver
) -> None:
    bench = started(worker, receiver, lost_after_s=600)
    receiver.says(gga())
    bench.wait_fact(*KNOWN)
    receiver.unplug()
    bench.detach("receiver")
    is_forgotten(bench)
    bench.behave("tell-position", **ASK).assert_failed("DEVICE_MISSING")
    other = SimulatedReceiver()
    bench.attach("receiver", other.node)
    other.says(gga())
    bench.wait_fact(*KNOWN)
    other.unplug()


def test_receiver_that_is_taken_away_is_let_go(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver, lost_after_s=600)
    receiver.says(gga())
    bench.wait_fact(*KNOWN)
    bench.detach("receiver")
    is_forgotten(bench)


def test_adapter_that_the_machine_names_does(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = worker(PLUGIN, devices={"adapter": receiver.node}, settings={"baud": 4800})
    receiver.says(gga())
    bench.wait_fact(*KNOWN)


def test_noise_on_the_line_changes_nothing(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver)
    receiver.says(b"\xb5\x62\x01$\xff\x00\n", gga()[20:], b"\xff" * 999, gga(10, 20))
    assert bench.wait_fact(*KNOWN).latitude_deg == pytest.approx(10)


def test_who_asks_is_answered(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver)
    receiver.says(gsa(3), gga())
    bench.wait_fact(*KNOWN)
    for _ in range(2):
        call = bench.behave("tell-position", **ASK).assert_succeeded()
        assert call.answer == "51.05000 N, 13.74000 E, 118 m, 8 satellites"


def test_who_asks_without_a_fix_is_told_why(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver)
    receiver.says(gsv("GP", 3), NO_FIX)
    bench.read("fix")
    call = bench.behave("tell-position", **ASK).assert_failed("GPS_NO_FIX")
    assert "3 satellites" in call.problem.message


def test_who_asks_a_silent_receiver_is_told(worker: Any, receiver: SimulatedReceiver) -> None:
    bench = started(worker, receiver)
    bench.behave("tell-position", **ASK).assert_failed("GPS_SILENT")


def test_port_that_cannot_be_opened_is_told_once(
    worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    attempts = threading.Semaphore(0)

    def counted(node: str, baud: int) -> SerialLine:
        attempts.release()
        return SerialLine(node, baud)

    monkeypatch.setattr("nondum_gps.plugin.SerialLine", counted)
    bench = worker(PLUGIN, devices={"receiver": "/dev/there-is-none"})
    for _ in range(3):
        assert attempts.acquire(timeout=30)
    assert len(bench.logs) == 1
    call = bench.behave("tell-position", **ASK).assert_failed("SERIAL_FAILED")
    assert "/dev/there-is-none" in call.problem.message


@pytest.mark.parametrize(
    "settings", [{"baud": 0}, {"lost_after_s": -1}, {"range_error_m": 0}, {"colour": "red"}]
)
def test_wrong_setting_refuses_the_component(worker: Any, settings: dict[str, Any]) -> None:
    with pytest.raises(NondumError) as raised:
        worker(PLUGIN, settings=settings)
    assert [problem.code for problem in raised.value.problems] == ["SETTING_INVALID"]
