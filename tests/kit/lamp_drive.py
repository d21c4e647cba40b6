"""A drive with a payload that does nothing, for jobs that read drives in this process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.kit.payloads import Part, make_payload

from nondum.sdk.errors import NondumError

LAMP = """
from nondum.sdk import Unit, hookimpl

@hookimpl
def units():
    return [Unit("lamp", "light")]
"""
PAYLOAD = "org.example.lamp"


def lamp(drive: Path, *, requires: str = "") -> Path:
    return make_payload(drive, Part("lamp", LAMP), payload_id=PAYLOAD, requires=requires)


def told(*_: object) -> None: ...


def code(work: Any, *arguments: Any, **more: Any) -> str:
    with pytest.raises(NondumError) as refused:
        work(*arguments, **more)
    return refused.value.code
