"""The names that payloads use, and which strings are names.

Ids are ASCII: what a person reads is what a machine compares.
"""

from __future__ import annotations

import re
from pathlib import PurePosixPath

PAYLOAD_ID = re.compile(r"(?=.{1,128}$)[a-z0-9][a-z0-9-]*(\.[a-z0-9][a-z0-9-]*)+")
COMPONENT_ID = re.compile(r"[a-z0-9](?:[a-z0-9]|-(?!-)){0,62}")
PATH = re.compile(r"[A-Za-z0-9_+!@=.,~-]+(/[A-Za-z0-9_+!@=.,~-]+)*")
MAX_PATH = 255


def path_flaw(path: str) -> str | None:
    """Why a path may not stand in a contents list or lock, or None when it may.

    >>> path_flaw("wheels/a-1-py3-none-any.whl")
    >>> path_flaw("../etc/passwd")
    'it leaves the payload folder'
    """
    if len(path) > MAX_PATH:
        return f"it is longer than {MAX_PATH} characters"
    if path.startswith("/") or ".." in PurePosixPath(path).parts:
        return "it leaves the payload folder"
    if not PATH.fullmatch(path):
        return "it has characters other than letters, digits and _+!@=.,~-/"
    if str(PurePosixPath(path)) != path:
        return "it is not in its shortest form"
    return None
