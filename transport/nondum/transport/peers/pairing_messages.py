"""What two hosts say while they are being paired, as bytes: pure, and as strict as `messages`.

One msgpack list a message, its kind first. Whatever a stranger sends, `decode` gives a value, or
raises.
"""

from __future__ import annotations

from enum import Enum
from typing import TypeAlias, get_args

from nondum.sdk.frozen import frozen
from nondum.sdk.packet_codec import PacketCodec
from nondum.sdk.wire import pack, unpack
from nondum.transport.peers.pairing import Message

MAX_BYTES = 512
"""In one message; the longest is a commit: key, name and hash."""


class Ending(Enum):
    """Why an end has given up a try; all that it says, so that no stranger's words are shown."""

    REFUSED = "refused"
    """Its person said no."""
    BUSY = "busy"
    """It is in another try."""
    UNWANTED = "unwanted"
    """It waits for another host, or has revoked this one's key."""
    NAME = "name"
    """It has the same name, or knows another host of that name."""
    TRIES = "tries"
    OVER = "over"
    """Its person has closed the window, or the time has."""
    BROKEN = "broken"
    """It was told what does not belong there, or nothing."""


@frozen
class Ended:
    """The try is over for the end that says so."""

    why: Ending


@frozen
class Beat:
    """Nothing: it is sent to learn whether the connection is still there."""


Said: TypeAlias = Message | Ended | Beat
"""The number of a kind on the wire is its place here."""


_PACKETS: PacketCodec[Said] = PacketCodec(get_args(Said))


def encode(said: Said) -> bytes:
    """Make the bytes of a message."""
    return pack(_PACKETS.fields(said), MAX_BYTES)


def decode(data: bytes | memoryview) -> Said:
    """Read a message.

    Raises `ProtocolViolation` (PACKET_…, HOST_NAME) or `PeerRefused` (KEY_MALFORMED) for anything
    that is not one exact message.
    """
    return _PACKETS.message(unpack(data, MAX_BYTES))
