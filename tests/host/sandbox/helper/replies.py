"""What the helper has answered."""

from __future__ import annotations

from nondum.host.rpc.outcomes import unpacked
from nondum.host.sandbox.helper import requests
from nondum.sdk.errors import NondumError
from nondum.sdk.wire import Reply, WireMessage


def code(answer: WireMessage) -> str:
    """The code of a refusal; none of a result."""
    assert isinstance(answer, Reply) and answer.id == requests.CALL
    try:
        unpacked(answer.body)
    except NondumError as error:
        return error.code
    return ""
