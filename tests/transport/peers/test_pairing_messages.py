"""Every message of pairing has one exact form."""

from __future__ import annotations

from typing import Any

import pytest

from nondum.sdk.errors import NondumError
from nondum.sdk.wire import pack
from nondum.transport.peers import PeerKey
from nondum.transport.peers.pairing import (
    HASH_BYTES,
    NONCE_BYTES,
    Agreed,
    Ask,
    Commit,
    Nonce,
)
from nondum.transport.peers.pairing_messages import Beat, Ended, Ending, Said, decode, encode

KEY = PeerKey("rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7")
HASH, NONCE = bytes(HASH_BYTES), bytes(NONCE_BYTES)
PACKED_KEY = b"\xd9(" + KEY.encode()


@pytest.mark.parametrize(
    ("said", "encoded"),
    [
        (Ask(KEY, "rover"), b"\x93\x00" + PACKED_KEY + b"\xa5rover"),
        (Commit(KEY, "lamp", HASH), b"\x94\x01" + PACKED_KEY + b"\xa4lamp\xc4\x20" + HASH),
        (Nonce(NONCE), b"\x92\x02\xc4\x10" + NONCE),
        (Agreed(HASH), b"\x92\x03\xc4\x20" + HASH),
        *((Ended(why), b"\x92\x04" + pack(why.value)) for why in Ending),
        (Beat(), b"\x91\x05"),
    ],
    ids=str,
)
def test_bytes_are_those_that_other_versions_read(said: Said, encoded: bytes) -> None:
    assert encode(said) == encoded
    assert decode(encoded) == said


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        (7, "PACKET_KIND"),
        ({}, "PACKET_KIND"),
        ([], "PACKET_KIND"),
        (["ask"], "PACKET_KIND"),
        ([False, KEY, "rover"], "PACKET_KIND"),
        ([-1], "PACKET_KIND"),
        ([6], "PACKET_KIND"),
        ([5, 1], "PACKET_FIELDS"),
        ([0, KEY], "PACKET_FIELDS"),
        ([0, KEY, "rover", 1], "PACKET_FIELDS"),
        ([0, 7, "rover"], "PACKET_FIELDS"),
        ([0, KEY, 7], "PACKET_FIELDS"),
        ([0, "key", "rover"], "KEY_MALFORMED"),
        ([0, KEY, "Rover"], "HOST_NAME"),
        ([1, KEY, "rover", HASH[1:]], "PACKET_FIELDS"),
        ([1, KEY, "rover", "x" * HASH_BYTES], "PACKET_FIELDS"),
        ([2, NONCE[1:]], "PACKET_FIELDS"),
        ([3, HASH + b"x"], "PACKET_FIELDS"),
        ([4, 7], "PACKET_FIELDS"),
        ([4, []], "PACKET_FIELDS"),
        ([4, "tired"], "PACKET_FIELDS"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_almost_right_is_refused(fields: Any, code: str) -> None:
    with pytest.raises(NondumError) as refused:
        decode(pack(fields))
    assert refused.value.code == code
