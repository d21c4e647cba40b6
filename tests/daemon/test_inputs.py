"""Optional inputs get what they ask for, a person decides where that is not enough, and a plugin's
wrong messages are seen by people."""

from __future__ import annotations

from typing import Any

import pytest
from tests.kit.golden import Golden
from tests.kit.payloads import Part
from tests.kit.running_host import RunningHost

pytestmark = pytest.mark.daemon

SENDER = '''"""Tells where something is, all the time."""
from nondum.sdk import Header, Output, Pose, Unit, hookimpl

@hookimpl
def units():
    return [Unit("it", "{type}", outputs=(Output("{name}", "pose", always=True),))]

@hookimpl
async def start(ctx):
    ctx.spawn(tell(ctx))

async def tell(ctx):
    output = ctx.output("{name}")
    while True:
        output.send(Pose(Header(), (1.0, 2.0, 0.0)))
        await ctx.sleep(0.05)
'''
READER = '''"""Would like to know how the body moves."""
from nondum.sdk import Input, Unit, hookimpl

@hookimpl
def units():
    return [Unit("camera", "camera", inputs=({input},))]
'''
CARELESS = '''"""Says where it is, in two dimensions."""
from nondum.sdk import Header, Pose, condition

@condition("position", predicates=("at",))
async def position(ctx):
    ctx.know("at", ctx.host, value=Pose(Header(), (1.0, 2.0)))
'''
GPS = Part("a-gps", SENDER.format(type="sensor", name="fix"))
BASE = Part("base", SENDER.format(type="base", name="odometry"))
EYE = Part("eye", READER.format(input='Input("odometry", "pose", of="base")'))
OLD_EYE = Part("old-eye", READER.format(input='Input("odometry", "pose")'))
"""As built before inputs said of what they are to be."""
FIX, ODOMETRY = "spot__a-gps__fix", "spot__base__odometry"
INPUT = "eye.camera.odometry"


def until_fed(host: RunningHost, name: str, stream: str | None) -> dict[str, Any]:
    """Wait until an optional input gets a stream; its row."""

    def found(view: Any) -> dict[str, Any] | None:
        rows = [row for row in view["inputs"] if row["input"] == name]
        return rows[0] if rows and rows[0]["stream"] == stream else None

    return host.until(f"{name} gets {stream}", found)


def until_flows(host: RunningHost, stream: str) -> None:
    host.until(
        f"{stream} flows",
        lambda view: any(s["stream"] == stream and s["flowing"] for s in view["streams"]),
    )


def test_odometry_of_the_base_is_waited_for_and_not_taken_from_a_gps(host: RunningHost) -> None:
    host.bring("a-gps", GPS)
    host.bring("eye", EYE)
    until_flows(host, FIX)
    row = until_fed(host, INPUT, None)
    assert row["could_be"] == [FIX]
    assert not row["ambiguous"]
    host.bring("base", BASE)
    assert until_fed(host, INPUT, ODOMETRY)["of"] == "base"
    assert "a pose of a base" in host.run("streams").out


def test_person_decides_what_an_input_gets_and_that_is_kept(
    own_host: RunningHost, golden: Golden
) -> None:
    host = own_host
    drives = [host.bring("a-gps", GPS), host.bring("base", BASE), host.bring("eye", EYE)]
    until_fed(host, INPUT, ODOMETRY)
    short = FIX.rpartition("__")[2]  # as the table of streams shows it
    told = host.run("streams", "--connect", INPUT, short).ok().out
    golden.check("a person connects a stream", told, input=INPUT, stream=short)
    until_fed(host, INPUT, FIX)
    host.stop()
    host.start()
    assert until_fed(host, INPUT, FIX)["connected"] == FIX
    host.pull(drives[0].name)
    assert until_fed(host, INPUT, None)["connected"] == FIX
    assert host.run("streams", "--disconnect", INPUT).code == 0
    assert until_fed(host, INPUT, ODOMETRY)["connected"] is None


@pytest.mark.parametrize(
    ("name", "stream", "code"),
    [
        ("eye.camera.odometri", FIX, "INPUT_UNKNOWN"),
        (INPUT, "spot__a-gps__fax", "STREAM_UNKNOWN"),
        ("base.it.odometry", ODOMETRY, "INPUT_UNKNOWN"),
    ],
)
def test_what_cannot_be_connected_is_refused(
    host: RunningHost, name: str, stream: str, code: str
) -> None:
    host.bring("a-gps", GPS)
    host.bring("base", BASE)
    host.bring("eye", EYE)
    ran = host.run("streams", "--connect", name, stream, "--json")
    assert ran.code == 1
    assert [problem["code"] for problem in ran.json["problems"]] == [code]


def test_ambiguity_is_told_and_named(host: RunningHost) -> None:
    host.bring("a-gps", GPS)
    host.bring("base", BASE)
    host.bring("old-eye", OLD_EYE)
    host.until_told("INPUT_AMBIGUOUS")
    assert until_fed(host, "old-eye.camera.odometry", FIX)["ambiguous"]


def test_wrong_message_is_the_components_problem(host: RunningHost) -> None:
    host.bring("careless", Part("careless", CARELESS))
    told = host.until_told("MESSAGE_FIELD")
    assert "careless" in told

    def ended(view: Any) -> dict[str, Any] | None:
        rows = [row for row in view["components"] if row["component"] == "careless"]
        return next((row for row in rows if "CONDITION_RAISED" in row["problem"]), None)

    row = host.until("its condition has ended", ended)
    assert row["problem"].count("MESSAGE_FIELD") == 1
    for said in ("careless", "test_careless.py:6", "pose.position", "MESSAGE_FIELD"):
        assert said in row["problem"]
    assert row["ready"]
