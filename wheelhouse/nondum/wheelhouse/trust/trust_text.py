"""Writing trust files: one form for each trust, and comments for those who read it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from datetime import datetime

from nondum.wheelhouse.trust.trust import Trust, TrustedKey
from nondum.wheelhouse.trust.trust_file import FORMAT


def to_text(trust: Trust) -> str:
    """The file that parses to `trust`."""
    return "\n".join(_lines(trust)) + "\n"


def _lines(trust: Trust) -> Iterator[str]:
    yield "# The keys that the robots of this owner trust. After a change, add 1 to `version`, and"
    yield "# have the roots sign the file again (`nondum keys sign`). See docs/trust.md."
    yield f"format = {_text(FORMAT)}"
    yield f"owner = {_text(trust.owner)}"
    yield f"version = {trust.version}"
    yield f"made = {_moment(trust.made)}"
    yield f"fleets = {_texts(trust.fleets)}"
    yield from ("", "[roots]", f"threshold = {trust.roots.threshold}")
    for root in trust.roots.keys:
        yield from _key("roots.key", root)
    for known in trust.keys:
        yield from _key("key", known)
    for role in trust.roles:
        yield from ("", "[[role]]", f"name = {_text(role.name)}")
        yield f"payloads = {_texts(role.payloads)}"
        yield f"keys = {_texts(role.keys)}"
        if role.threshold != 1:
            yield f"threshold = {role.threshold}"
        yield f"permissions = {_texts(role.permissions)}"
        if most := role.most.given():
            yield f"most = {{ {', '.join(f'{key} = {bound}' for key, bound in most.items())} }}"
    for bounds in trust.bounds:
        yield from ("", "[[release]]", f"payload = {_text(bounds.payload)}")
        yield f"least = {bounds.least}"
        if bounds.most is not None:
            yield f"most = {bounds.most}"
    for gone in trust.revoked:
        yield from ("", "[[revoked]]", f"fingerprint = {_text(gone.fingerprint)}")
        yield f"why = {_text(gone.why)}"


def _key(table: str, known: TrustedKey) -> Iterator[str]:
    yield from ("", f"[[{table}]]", f"name = {_text(known.name)}")
    yield f"key = {_text(known.key.line)}"
    if known.since is not None:
        yield f"since = {_moment(known.since)}"
    if known.until is not None:
        yield f"until = {_moment(known.until)}"


def _moment(moment: datetime) -> str:
    return _text(moment.strftime("%Y-%m-%dT%H:%M:%SZ"))


def _text(text: str) -> str:
    """A basic string: what JSON escapes, TOML reads."""
    return json.dumps(text, ensure_ascii=False)


def _texts(texts: Iterable[str]) -> str:
    return f"[{', '.join(map(_text, texts))}]"
