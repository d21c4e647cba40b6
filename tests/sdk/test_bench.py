"""A plugin's whole life on the test bench, over the protocol that workers speak."""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import Any

import pytest
from tests.sdk import greeter

from nondum.sdk import Bearing, Header, Text, ThreadContext, WorkerFailed, condition
from nondum.sdk import bench as sdk_bench
from nondum.sdk.bench import Bench, WorkerFactory


@pytest.fixture
def bench(worker: WorkerFactory) -> Bench:
    return worker(
        greeter,
        settings={"volume": 3},
        devices={"horn": "/dev/snd/horn"},
        mounts={"mouth": ((0.1, 0.0, 0.5), (0.0, 0.0, math.pi / 2))},
    )


def test_finishing_behaviour_succeeds(bench: Bench) -> None:
    call = bench.behave("greet", u="mouth", h="robot").assert_succeeded()
    assert call.progress == [(0.5, "clearing the throat")]
    assert bench.read("words").text == "hello robot"
    assert ("greeted", "robot") in bench.facts


def test_text_that_a_behaviour_returns_is_its_answer(bench: Bench) -> None:
    assert bench.behave("greet", u="mouth", h="robot").wait().answer == "robot was greeted"
    assert bench.behave("await-hint", u="mouth").answer == ""


def test_own_failure_keeps_its_words(bench: Bench) -> None:
    call = bench.behave("greet", u="mouth", h="absent").assert_failed()
    assert call.problem is not None
    assert call.problem.message == greeter.NO_ONE


def test_other_errors_are_failures_with_a_place(bench: Bench) -> None:
    call = bench.behave("greet", u="mouth", h="error").assert_failed("BEHAVIOUR_RAISED")
    assert call.problem is not None
    assert "ZeroDivisionError" in call.problem.message
    assert "greeter.py:" in call.problem.where


def test_lasting_behaviour_lasts_until_halted(bench: Bench) -> None:
    call = bench.behave("sing", u="mouth", o="words").wait_established()
    message = bench.read("words")
    assert message.header.frame_id == "robot__plugin__mouth"
    assert bench.objects["words"] in bench.flowing
    assert call.halt().state == "halted"
    bench.wait_until(lambda: bench.objects["words"] not in bench.flowing, "the end of the flow")


def test_plain_function_waits_in_its_thread(bench: Bench) -> None:
    call = bench.behave("echo", u="mouth", i="heard", o="words").wait_established()
    for text in ("one", "two"):
        bench.feed(Text(Header(), text), stream="heard")
        assert bench.read("words").text == text
    assert call.halt().state == "halted"


def test_busy_plain_function_sees_that_it_is_halted(bench: Bench) -> None:
    call = bench.behave("work", u="mouth")
    bench.wait_fact("working", "mouth")
    assert call.halt().state == "halted"
    assert not any(fact[0] == "never" for fact in bench.facts)


def test_optional_input_is_fed_by_its_slot(bench: Bench) -> None:
    call = bench.behave("await-hint", u="mouth")
    bench.feed(Text(Header(), "psst"), slot="hints")
    call.assert_succeeded()
    bench.wait_fact("hinted", "psst")


def test_values_are_transformed_by_mounts(bench: Bench) -> None:
    ahead = Bearing(Header(frame_id=bench.objects["mouth"]), (1.0, 0.0, 0.0), 0.01)
    bench.set_value("bearing-known", "gate", "robot", value=ahead)
    bench.behave("turn", u="mouth", to_where="gate").assert_succeeded()
    turned = bench.wait_fact("turned", "gate")
    assert turned.header.frame_id == "robot"
    assert turned.azimuth_rad == pytest.approx(math.pi / 2)


def test_value_that_went_away_is_unknown(bench: Bench) -> None:
    ahead = Bearing(Header(frame_id="robot"), (1.0, 0.0, 0.0), 0.01)
    bench.set_value("bearing-known", "gate", "robot", value=ahead)
    bench.unset_value("bearing-known", "gate", "robot")
    bench.behave("turn", u="mouth", to_where="gate").assert_failed("VALUE_UNKNOWN")


@pytest.mark.parametrize(
    ("until", "state", "status"),
    [("done", "succeeded", "success"), ("fail", "failed", "failure")],
)
def test_ticked_behaviour_ends_by_its_status(
    bench: Bench, until: str, state: str, status: str
) -> None:
    assert bench.behave("count", u="mouth", h=until).wait().state == state
    bench.wait_fact("counted", "1", status)


def test_ticked_behaviour_is_established_and_halted(bench: Bench) -> None:
    call = bench.behave("count", u="mouth", h="forever").wait_established()
    assert call.halt().state == "halted"
    bench.wait_fact("counted", "1", "invalid")


def test_condition_speaks_while_the_worker_runs(bench: Bench) -> None:
    bench.wait_fact("raining", "robot")
    assert isinstance(bench.wait_fact("bearing-known", "sun", "robot"), Bearing)
    bench.stop()
    assert ("raining", "robot") not in bench.facts
    assert ("stopped", "robot") in bench.facts
    assert ("info", "silent") in bench.logs


def test_start_hook_may_send_what_is_always_produced(bench: Bench) -> None:
    assert bench.read("volume").value == 0.5


def test_serving_hooks_answer(bench: Bench) -> None:
    assert bench.ask("speak", text="good morning") == {}
    assert ("spoken", "good morning") in bench.facts
    assert bench.ask("translate_goal", words="sing something") == {}


@pytest.mark.parametrize(
    ("verb", "body", "code"),
    [
        ("fly", {}, "VERB_UNKNOWN"),
        ("behave", {"behaviour": "fly", "arguments": {}}, "BEHAVIOUR_UNKNOWN"),
        ("behave", {"behaviour": "greet", "arguments": {"u": "x"}}, "ARGUMENTS"),
        ("produce", {"stream": "s", "type": "text", "consumer": "x"}, "STREAM_HANDLE"),
    ],
)
def test_wrong_requests_are_refused(
    bench: Bench, verb: str, body: dict[str, Any], code: str
) -> None:
    with pytest.raises(WorkerFailed) as caught:
        bench.ask(verb, **body)
    assert caught.value.code == code


class Stuck:
    """Waits for its device as plain functions must not: nothing wakes it when it is halted."""

    def __init__(self) -> None:
        self.device = threading.Event()

    @condition("warm", predicates=())
    def warm(self, ctx: ThreadContext) -> None:
        self.device.wait()


def test_function_that_does_not_return_is_named_with_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sdk_bench, "STOP_S", 0.2)
    stuck = Stuck()
    bench = Bench(stuck, scratch=tmp_path)
    line = Stuck.warm.__code__.co_firstlineno + 2
    with pytest.raises(AssertionError, match=rf"WORKER_HUNG.* in warm, .*test_bench.py:{line} "):
        bench.stop()
    bench.stop()
    stuck.device.set()
