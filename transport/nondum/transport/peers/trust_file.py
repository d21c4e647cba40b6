"""Where a host keeps its trust: one JSON file, which only its owner may change.

{"format": "nondum-trust@1", "fleets": {KEY: NAME}, "paired": {KEY: NAME}, "revoked": {KEY: WHY}}
"""

from __future__ import annotations

import json
from pathlib import Path

from nondum.sdk.errors import Problem
from nondum.transport.peers import private_file
from nondum.transport.peers.certificate import FleetKey
from nondum.transport.peers.failures import PeerRefused
from nondum.transport.peers.keys import parse_key
from nondum.transport.peers.trust import Trust

_FORMAT = "nondum-trust@1"
_PARTS = ("fleets", "paired", "revoked")


def load(path: Path) -> Trust:
    """Read a trust file; without one no key is trusted.

    Raises `PeerRefused` (FILE_OPEN_TO_OTHERS, FILE_MALFORMED, KEY_MALFORMED), `OSError`.
    """
    if not path.exists():
        return Trust()
    return parse(private_file.read_own(path), str(path))


def save(path: Path, trust: Trust) -> None:
    """Write a trust file, whole or not at all. Raises `OSError`."""
    private_file.replace(path, to_text(trust))


def to_text(trust: Trust) -> str:
    """The text of a trust file."""
    parts = {name: dict(sorted(getattr(trust, name).items())) for name in _PARTS}
    return json.dumps({"format": _FORMAT, **parts}, indent=2) + "\n"


def parse(text: str, where: str = "") -> Trust:
    """Read the text of a trust file. Raises `PeerRefused` (FILE_MALFORMED, KEY_MALFORMED)."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _malformed(f"it is no JSON: {error}", where) from error
    if not isinstance(data, dict) or data.keys() != {"format", *_PARTS}:
        raise _malformed(f"it is not one table of format, {', '.join(_PARTS)}", where)
    if data["format"] != _FORMAT or not all(_is_texts(data[part]) for part in _PARTS):
        raise _malformed(f"it is not {_FORMAT} with tables of texts", where)
    return Trust(
        {FleetKey(key): name for key, name in data["fleets"].items()},
        {parse_key(key): name for key, name in data["paired"].items()},
        {parse_key(key): why for key, why in data["revoked"].items()},
    )


def _is_texts(value: object) -> bool:
    return isinstance(value, dict) and all(type(text) is str for text in value.values())


def _malformed(what: str, where: str) -> PeerRefused:
    return PeerRefused(Problem("FILE_MALFORMED", what, where=where))
