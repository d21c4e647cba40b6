"""What a worker, an operator and a file say to the host they are on."""

from __future__ import annotations

from tests.fuzz.target import Target, of_text
from tests.fuzz.tokens import JSON, MSGPACK, TOML

from nondum.host.config import host_config, parsing
from nondum.host.control import protocol as control
from nondum.sdk import wire
from nondum.sdk.errors import Problem

WHERE = "fuzzed"


def _frames() -> list[bytes]:
    body = {"a": 1, "b": [1.5, "x", None, True], "c": {"d": b"\0"}}
    said = (
        wire.Hello((1, 2), "0.1", 7),
        wire.Welcome(1, body),
        wire.Request(3, "behave", body),
        wire.Reply(3, body),
        wire.Failure(3, (Problem("CODE", "message", "where", "need", "have", "fix"),)),
        wire.Event("progress", 3, body),
        wire.Cancel(3),
    )
    return [wire.encode(each) for each in said]


def _requests() -> list[bytes]:
    return [control.encode_request(control.Request("goal", {"words": "follow me"}))]


CONFIG = b"""\
[host]
name = "rover"
state = "/var/lib/nondum"

[drives]
slots = ["/run/slots"]
allow_unsigned = false

[workers]
memory_mb = 512

[peers]
listen = ["tcp://*:7410"]
"""


def _read_config(text: str) -> object:
    return parsing.parse(text, WHERE, host_config.user_config())


TARGETS = (
    Target("worker frame", wire.decode, _frames, tokens=MSGPACK, cases=1_000_000),
    Target("control request", control.decode_request, _requests, tokens=JSON),
    Target(
        "configuration",
        of_text(_read_config),
        lambda: [CONFIG],
        tokens=TOML,
    ),
)
