"""A plugin with one of everything, for the SDK's own tests."""

from __future__ import annotations

import asyncio

from nondum.sdk import (
    Bearing,
    BehaviourFailed,
    Context,
    DeviceNeed,
    Fragment,
    Header,
    Input,
    Label,
    Output,
    Phrase,
    Scalar,
    Status,
    Text,
    ThreadContext,
    TickedBehaviour,
    Unit,
    behaviour,
    condition,
    hookimpl,
)

DOMAIN = "(define (domain greeter) (:predicates (greeted ?h - host)))"
NO_ONE = "no one is there"


@hookimpl
def units() -> list[Unit]:
    return [
        Unit(
            "mouth",
            "speaker",
            outputs=(Output("words", "text"), Output("volume", "scalar", always=True)),
            inputs=(Input("hints", "text"),),
        )
    ]


@hookimpl
def fragments() -> list[Fragment]:
    return [Fragment("domain.pddl", DOMAIN)]


@hookimpl
def devices() -> list[DeviceNeed]:
    return [DeviceNeed("horn", {"SUBSYSTEM": "sound"}, optional=True)]


@hookimpl
def phrases() -> list[Phrase]:
    return [Phrase("say hello", "(greeted self)")]


@hookimpl
def labels() -> list[Label]:
    return [Label("mouth", "the loudspeaker")]


@hookimpl
async def start(ctx: Context) -> None:
    ctx.output("volume").send(Scalar(Header(), 0.5, "1"))


@hookimpl
def stop(ctx: ThreadContext) -> None:
    ctx.log.info("silent")
    ctx.know("stopped", ctx.host)


@hookimpl
async def speak(ctx: Context, text: str) -> None:
    ctx.know("spoken", text)


@behaviour("greet", action="(greet ?u - speaker ?h - host)", phrase="greet {h}")
async def greet(ctx: Context, u: str, h: str) -> str:
    """Say hello once."""
    ctx.progress(0.5, "clearing the throat")
    ctx.output("words").send(Text(Header(frame_id=u), f"hello {h}"))
    if h == "absent":
        raise BehaviourFailed(NO_ONE)
    if h == "error":
        raise ZeroDivisionError("a mistake of the author")
    ctx.know("greeted", h)
    return f"{h} was greeted"


@behaviour("sing", action="(sing ?u - speaker ?o - text)", lasting=True)
async def sing(ctx: Context, u: str, o: str) -> None:
    output = ctx.output(o)
    await ctx.established()
    while True:
        output.send(Text(Header(frame_id=u), "la"))
        await ctx.sleep(0.01)


@behaviour("echo", action="(echo ?u - speaker ?i - text ?o - text)", lasting=True)
def echo(ctx: ThreadContext, u: str, i: str, o: str) -> None:
    heard, output = ctx.input(i), ctx.output(o)
    ctx.established()
    for message in heard:
        output.send(message)


@behaviour("await-hint", action="(await-hint ?u - speaker)")
async def await_hint(ctx: Context, u: str) -> None:
    hint = await ctx.optional_input("hints").next(timeout_s=60)
    ctx.know("hinted", hint.text)


@behaviour("turn", action="(turn ?u - speaker ?to-where - place)")
async def turn(ctx: Context, u: str, to_where: str) -> None:
    bearing = ctx.transform(ctx.value("bearing-known", to_where, ctx.host), ctx.host)
    ctx.know("turned", to_where, value=bearing)


@behaviour("work", action="(work ?u - speaker)")
def work(ctx: ThreadContext, u: str) -> None:
    ctx.know("working", u)
    while not ctx.is_halted:
        pass
    ctx.know("never", u)


@behaviour("count", action="(count ?u - speaker ?h - host)", lasting=True)
class Count(TickedBehaviour):
    rate_hz = 1000.0

    def setup(self, ctx: Context) -> None:
        self.runs = 0

    def initialise(self, ctx: Context, u: str, h: str) -> None:
        self.ctx, self.runs, self.ticks, self.until = ctx, self.runs + 1, 0, h

    def update(self) -> Status:
        self.ticks += 1
        self.is_established = self.ticks > 2
        if self.ticks < 5 or self.until == "forever":
            return Status.RUNNING
        self.feedback_message = "counted to five"
        return Status.FAILURE if self.until == "fail" else Status.SUCCESS

    def terminate(self, status: Status) -> None:
        self.ctx.know("counted", str(self.runs), status.value)


@condition("weather", predicates=("raining", "bearing-known"))
async def weather(ctx: Context) -> None:
    ctx.know("raining", ctx.host)
    ctx.know("bearing-known", "sun", ctx.host, value=Bearing(Header(), (0.0, 0.0, 1.0), 0.1))
    await asyncio.Event().wait()
