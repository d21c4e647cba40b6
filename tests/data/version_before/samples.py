"""Packets of the version before that two hosts do not say to each other in a moment. `make.py` runs
it.

    CHECKOUT/.venv/bin/python samples.py

As JSON: name → hexadecimal digits of its parts.
"""

from __future__ import annotations

import json
import sys

from nondum.transport.bridge import packets
from nondum.transport.bridge.packets import Claim, Coding, Frame, Handled, Opened, Over, Ping, Pong

from nondum.sdk.errors import Problem, ProtocolViolation
from nondum.transport.discovery import packets as discovery
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.peers.keys import PeerKey
from nondum.transport.peers.messages import Bye, Hello, Refused, agreed_version, encode

NONCE = bytes(range(discovery.NONCE))
HERE = Announcement(PeerKey("development:before"), "before", 7, ("tcp://[::]:7410",))
FRAME = Frame(2, Coding.RAW, {"width": 2, "height": 1}, b"ab")
FUTURE = Hello((99,), "future", "development:future", 7, 1, b"")


def refusal() -> Problem:
    """What it says to a host that speaks another version alone."""
    try:
        agreed_version(FUTURE)  # type: ignore[call-arg]  # as it was then
    except ProtocolViolation as error:
        return error.problems[0]
    raise SystemExit("version 99 is spoken")


SAMPLES = {
    "refused": (encode(Refused(refusal())),),
    "bye": (encode(Bye("closed")),),
    "question": (discovery.question(NONCE),),
    "answer": (discovery.answer(NONCE, HERE),),
    "claim": (packets.asked(Claim(packets.VERSION, "token")),),
    "handled": (packets.asked(Handled(2)),),
    "ping": (packets.asked(Ping(1.5)),),
    "opened": (packets.told(Opened("text")),),
    "pong": (packets.told(Pong(1.5, 2.5)),),
    "over": (packets.told(Over(Problem("STREAM_GONE", "it has ended"))),),
    "frame": (packets.head(FRAME), b"ab"),
}

json.dump({name: [part.hex() for part in parts] for name, parts in SAMPLES.items()}, sys.stdout)
