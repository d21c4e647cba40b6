"""This moment, by both clocks."""

from __future__ import annotations

import time

from nondum.host.core.records.moment import Moment


def now() -> Moment:
    """This moment by both clocks."""
    return Moment(time.monotonic(), time.time())
