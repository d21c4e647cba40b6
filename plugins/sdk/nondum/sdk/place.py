"""Where in an author's own code something was asked of the SDK: file and line, for messages."""

from __future__ import annotations

import sys
from types import FrameType

_OWN = "nondum.sdk."
_LIBRARIES = ("site-packages", "dist-packages")


def author_place() -> str:
    """The nearest caller outside the SDK, as `package/plugin.py:95`; empty where there is none.

    Call it on the author's thread. It walks frames, so it is for what goes wrong, not for each
    message.
    """
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if not frame.f_globals.get("__name__", "").startswith(_OWN):
            return f"{short_path(frame.f_code.co_filename)}:{frame.f_lineno}"
        frame = frame.f_back
    return ""


def short_path(path: str) -> str:
    """A file's path from where Python found it: people know their package, not its environment.

    >>> short_path("/var/lib/nondum/venvs/3f/lib/python3.11/site-packages/gps/plugin.py")
    'gps/plugin.py'
    >>> short_path("/home/me/gps/plugin.py")
    '/home/me/gps/plugin.py'
    """
    for folder in _LIBRARIES:
        _, found, rest = path.rpartition(f"/{folder}/")
        if found:
            return rest
    return path
