"""`index.json`: what each component's plugin says of itself, captured when the payload was built.

{"format": 1, "components": {"<id>": {description}, …}}
"""

from __future__ import annotations

import json
from collections.abc import Mapping

from nondum.sdk.description import PluginDescription
from nondum.sdk.errors import NondumError, PayloadRefused, Problem

NAME = "index.json"
MAX_BYTES = 4 * 1024 * 1024
FORMAT = 1

Index = Mapping[str, PluginDescription]
"""Component id → what its plugin says."""


def parse(data: bytes, where: str) -> Index:
    """Check and parse an index. Raises `PayloadRefused` (INDEX_INVALID, DESCRIPTION_INVALID)."""
    if len(data) > MAX_BYTES:
        raise _refused("TOO_LARGE", f"is longer than {MAX_BYTES} bytes", where)
    try:
        document = json.loads(data)
        json.dumps(document, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:  # JSON can express it, UTF-8 cannot
        text = f"has an unpaired surrogate in it: {error.object[error.start : error.end]!r}"
        raise _refused("INDEX_INVALID", text, where) from error
    except (ValueError, RecursionError) as error:
        raise _refused("INDEX_INVALID", f"is not JSON: {error}", where) from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise _refused("INDEX_INVALID", f"expected format {FORMAT}", where)
    components = document.get("components")
    if not isinstance(components, dict):
        raise _refused("INDEX_INVALID", "expected a table of components", where)
    index: dict[str, PluginDescription] = {}
    problems: list[Problem] = []
    for component, said in components.items():
        try:
            index[component] = PluginDescription.parse(said, where=f"{where} {component}")
        except NondumError as error:
            problems.extend(error.problems)
    if problems:
        raise PayloadRefused(*problems)
    return index


def to_bytes(index: Index) -> bytes:
    """The index as it stands on a drive: the same bytes for the same index."""
    components = {component: index[component].to_dict() for component in sorted(index)}
    document = {"format": FORMAT, "components": components}
    text = json.dumps(document, ensure_ascii=False, indent=1, sort_keys=True)
    return text.encode() + b"\n"


def _refused(code: str, message: str, where: str) -> PayloadRefused:
    return PayloadRefused(Problem(code, message, where=where, fix="build the payload again"))
