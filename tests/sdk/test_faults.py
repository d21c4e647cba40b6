"""Wrong messages: told at once, with the author's line, on the bench and to the host."""

from __future__ import annotations

import asyncio
import inspect
import mmap
import re
from types import FunctionType

import pytest

from nondum.sdk import (
    Context,
    Fragment,
    Header,
    Image,
    MessageInvalid,
    Output,
    Pose,
    Scalar,
    ThreadContext,
    Unit,
    behaviour,
    condition,
    hookimpl,
)
from nondum.sdk.bench import Bench, WorkerFactory
from nondum.sdk.place import author_place

WRONG = Pose(Header(), (1.0, 2.0))  # type: ignore[arg-type]  # the mistake
RIGHT = Pose(Header(), (1.0, 2.0, 3.0))
DOMAIN = """(define (domain careless)
  (:predicates (at ?h - host) (warm ?h - host))
  (:valued warm at - pose)) ; (:valued warm - text)"""


class Careless:
    """Sends and says what is wrong, in all the ways there are."""

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        return (Unit("it", "sensor", outputs=(Output("fix", "pose"),)),)

    @hookimpl
    def fragments(self) -> tuple[Fragment, ...]:
        return (Fragment("domain.pddl", DOMAIN),)

    @behaviour("send", action="(send ?u - sensor)")
    async def send(self, ctx: Context, u: str) -> None:
        ctx.output("fix").send(WRONG)

    @behaviour("send-in-a-thread", action="(send-in-a-thread ?u - sensor)")
    def send_in_a_thread(self, ctx: ThreadContext, u: str) -> None:
        ctx.output("fix").send(WRONG)

    @behaviour("say", action="(say ?u - sensor)")
    async def say(self, ctx: Context, u: str) -> None:
        ctx.know("at", ctx.host, value=WRONG)

    @behaviour("say-in-a-thread", action="(say-in-a-thread ?u - sensor)")
    def say_in_a_thread(self, ctx: ThreadContext, u: str) -> None:
        ctx.know("at", ctx.host, value=WRONG)

    @behaviour("say-another-type", action="(say-another-type ?u - sensor)")
    async def say_another_type(self, ctx: Context, u: str) -> None:
        ctx.know("at", ctx.host, value=Scalar(Header(), 1.0, "m"))

    @behaviour("send-another-type", action="(send-another-type ?u - sensor)")
    async def send_another_type(self, ctx: Context, u: str) -> None:
        ctx.output("fix").send(Scalar(Header(), 1.0, "m"))

    @behaviour("go-on", action="(go-on ?u - sensor)")
    async def go_on(self, ctx: Context, u: str) -> None:
        for message in (WRONG, WRONG, RIGHT):
            try:
                ctx.output("fix").send(message)
            except MessageInvalid as error:
                ctx.log.info("%s", error.code)


class Wide:
    """Sends an image with one row more than a message may have."""

    @hookimpl
    def units(self) -> tuple[Unit, ...]:
        return (Unit("it", "camera", outputs=(Output("image", "image"),)),)

    @behaviour("send", action="(send ?u - camera)")
    async def send(self, ctx: Context, u: str) -> None:
        size = 16384
        data = memoryview(
            mmap.mmap(-1, (size + 1) * size)
        )  # pages that are never touched cost no memory
        ctx.output("image").send(Image(Header(), size + 1, size, "mono8", size, data))


class CarelessCondition:
    """Says a wrong value where no task waits for an end."""

    @condition("position", predicates=("at",))
    async def position(self, ctx: Context) -> None:
        ctx.know("at", ctx.host, value=WRONG)


class Dying:
    """Its condition, or what it spawned, ends with an error where no task waits for an end."""

    @hookimpl
    async def start(self, ctx: Context) -> None:
        ctx.spawn(asyncio.wait_for(self.tell(ctx), 60.0))

    async def tell(self, ctx: Context) -> None:
        if ctx.settings["dies"] == "spawned":
            int("no number")

    @condition("position", predicates=("at",))
    async def position(self, ctx: Context) -> None:
        if ctx.settings["dies"] == "condition":
            raise RuntimeError("it is gone")
        await ctx.sleep(3600.0)


def line_of(function: object, text: str) -> str:
    """Where this file says something."""
    assert isinstance(function, FunctionType)
    lines, first = inspect.getsourcelines(function)
    (line,) = (first + i for i, found in enumerate(lines) if text in found)
    return f"{__file__}:{line}"


@pytest.mark.parametrize(
    ("name", "code", "field"),
    [
        ("send", "MESSAGE_FIELD", "pose.position"),
        ("send-in-a-thread", "MESSAGE_FIELD", "pose.position"),
        ("say", "MESSAGE_FIELD", "pose.position"),
        ("say-in-a-thread", "MESSAGE_FIELD", "pose.position"),
        ("say-another-type", "MESSAGE_TYPE", "value of at"),
        ("send-another-type", "MESSAGE_TYPE", "carries Pose, not Scalar"),
    ],
)
def test_wrong_message_is_told_with_type_field_and_line(
    worker: WorkerFactory, name: str, code: str, field: str
) -> None:
    bench = worker(Careless)
    call = bench.behave(name, u="it")
    fault = bench.expect_fault(code)
    assert field in fault.message
    sent = "send(" if name.startswith("send") else "know("
    method = vars(Careless)[name.replace("-", "_")]
    assert fault.where == line_of(method, f"ctx.{'output' if sent == 'send(' else 'know('}")
    assert call.wait().state == "failed"
    assert any(code in message for level, message in bench.logs if level == "error")


def test_wrong_message_fails_the_test_at_once(worker: WorkerFactory) -> None:
    bench = worker(Careless)
    bench.behave("send", u="it")
    with pytest.raises(AssertionError, match=r"MESSAGE_FIELD .*test_faults.py:\d+: pose.position"):
        bench.read("fix")


def test_wrong_value_of_a_condition_fails_the_test_at_once(worker: WorkerFactory) -> None:
    bench = worker(CarelessCondition)
    with pytest.raises(AssertionError, match="MESSAGE_FIELD"):
        bench.wait_fact("at", "robot")


@pytest.mark.parametrize(
    ("dies", "code", "method", "text"),
    [
        ("condition", "CONDITION_RAISED", Dying.position, "raise RuntimeError"),
        ("spawned", "SPAWNED_RAISED", Dying.tell, 'int("no'),
    ],
)
def test_what_dies_unseen_fails_the_test_at_once(
    worker: WorkerFactory, dies: str, code: str, method: object, text: str
) -> None:
    bench = worker(Dying, settings={"dies": dies})
    with pytest.raises(AssertionError, match=f"{code} {re.escape(line_of(method, text))}"):
        bench.wait_fact("at", "robot")


def test_what_dies_may_be_expected(worker: WorkerFactory) -> None:
    bench = worker(Dying, settings={"dies": "condition"})
    assert bench.expect_fault("CONDITION_RAISED").message == "RuntimeError: it is gone"


def test_condition_that_ends_by_a_wrong_message_is_told_once(worker: WorkerFactory) -> None:
    bench = worker(CarelessCondition)
    bench.expect_fault("MESSAGE_FIELD")
    bench.wait_until(lambda: any("ended" in message for _, message in bench.logs), "its end")
    assert bench.side.faults == []


def test_wrong_message_that_no_test_waited_for_fails_it_at_its_end(worker: WorkerFactory) -> None:
    bench: Bench = worker(Careless)
    bench.on_loop(lambda: None)
    call = bench.behave("go-on", u="it")
    bench.expect_fault("MESSAGE_FIELD")
    call.wait()
    bench.behave("send", u="it")
    with pytest.raises(AssertionError, match="MESSAGE_FIELD"):
        bench.wait_until(lambda: False, "nothing")
        bench.stop()


def test_behaviour_may_go_on_and_each_mistake_is_told_once(worker: WorkerFactory) -> None:
    bench = worker(Careless)
    call = bench.behave("go-on", u="it")
    bench.expect_fault("MESSAGE_FIELD")
    call.assert_succeeded()
    assert bench.read("fix") == RIGHT
    assert bench.side.faults == []
    assert [message for _, message in bench.logs].count("MESSAGE_FIELD") == 2


def test_place_is_the_nearest_caller_outside_the_sdk() -> None:
    here = test_place_is_the_nearest_caller_outside_the_sdk
    assert author_place() == line_of(here, "== line_of(here")


def test_message_that_no_reader_takes_is_refused_where_it_is_sent(worker: WorkerFactory) -> None:
    bench = worker(Wide)
    call = bench.behave("send", u="it")
    problem = bench.expect_fault("MESSAGE_TOO_LONG")
    assert call.wait().state == "failed"
    assert problem.where == line_of(Wide.send, ".send(Image")
    assert (problem.need, problem.have) == ("at most 268435456 bytes", "268451840 bytes")
