"""What other hosts send: who they are, what they say, and their streams."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from tests.fuzz.target import Target, of_text
from tests.fuzz.tokens import MSGPACK

from nondum.sdk.errors import Problem
from nondum.transport.discovery import hint
from nondum.transport.discovery import packets as discovery
from nondum.transport.discovery.announcement import Announcement
from nondum.transport.discovery.hint import Source
from nondum.transport.peers import certificate, messages, pairing, pairing_messages
from nondum.transport.peers.identity import Security
from nondum.transport.peers.keys import PeerKey
from nondum.transport.streams import packets as bridge

KEY = PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7")


def _peer_messages() -> list[bytes]:
    hello = messages.Hello((1,), "rover", "k" * 40, 5, 1, b"")
    body = {"a": [1, 2.5, "x"], "b": {"c": None}}
    problem = Problem("CODE", "message")
    said = (
        hello,
        messages.Welcome(hello),
        messages.Refused(problem),
        messages.Request(2, 1, 1000, "behave", body),
        messages.Reply(1, body),
        messages.Failure(1, (problem,)),
        messages.Progress(1, body),
        messages.Cancel(1),
        messages.Notice("changed", body),
        messages.Ping(3),
        messages.Pong(3),
        messages.Bye("stopped"),
    )
    return [messages.encode(each) for each in said]


def _pairing_messages() -> list[bytes]:
    commit = pairing.Commit(KEY, "rover", bytes(pairing.HASH_BYTES))
    said = (
        pairing.Ask(KEY, "rover"),
        commit,
        pairing_messages.Beat(),
        pairing_messages.Ended(pairing_messages.Ending.BUSY),
    )
    return [pairing_messages.encode(each) for each in said]


def _certificates() -> list[bytes]:
    _, secret = certificate.new_fleet()
    begin, end = datetime(2026, 1, 1, tzinfo=UTC), datetime(2027, 1, 1, tzinfo=UTC)
    made = certificate.issue(secret, "rover", KEY, not_before=begin, not_after=end)
    return [made.to_bytes()]


def _announcement() -> Announcement:
    return Announcement(KEY, "rover", 7, ("tcp://0.0.0.0:7410",), pairing_port=7411)


def _answers() -> list[bytes]:
    return [discovery.answer(bytes(discovery.NONCE), _announcement())]


def _read_datagram(data: bytes) -> object:
    """Asked, answered, and what is answered judged as a hint."""
    discovery.nonce_of(data)
    told = discovery.read_answer(data)
    return _hint(told.txt, told.port)


def _txts() -> list[bytes]:
    return [json.dumps(hint.to_txt(_announcement())).encode()]


def _read_txt(text: str) -> object:
    """The fields of a DNS-SD record; JSON stands for what zeroconf has taken apart."""
    try:
        txt: Any = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(txt, dict) or any(type(value) is not str for value in txt.values()):
        return None
    return _hint(txt, 7410)


def _hint(txt: Mapping[str, str], port: int) -> object:
    hosts = ("192.0.2.1", "fe80::1%eth0")
    return hint.from_txt(txt, port, hosts, source=Source.MULTICAST, security=Security.CURVE)


def _asked() -> list[bytes]:
    claims = (bridge.Claim(1, "token"), bridge.Handled(3), bridge.Ping(1.5))
    return [bridge.asked(claim) for claim in claims]


def _told() -> list[bytes]:
    over = bridge.Over(Problem("CODE", "message"))
    frame = bridge.Frame(3, bridge.Coding.RAW, {"t": 1.0}, (b"bulk",))
    return [
        bridge.head(frame),
        bridge.told(bridge.Opened("image")),
        bridge.told(bridge.Pong(1.0, 2.0)),
        bridge.told(over),
    ]


TARGETS = (
    Target("peer message", messages.decode, _peer_messages, tokens=MSGPACK),
    Target("pairing message", pairing_messages.decode, _pairing_messages, tokens=MSGPACK),
    Target("certificate", certificate.parse, _certificates, tokens=(b": ", b"\n", b"+0000")),
    Target("datagram", _read_datagram, _answers, tokens=MSGPACK),
    Target("TXT record", of_text(_read_txt), _txts, tokens=(b'"pk"', b'"proto"', b'"epoch"', b",")),
    Target("stream, asked", bridge.read_asked, _asked, tokens=MSGPACK),
    Target("stream, told", lambda data: bridge.read_told([data]), _told, tokens=MSGPACK),
)
