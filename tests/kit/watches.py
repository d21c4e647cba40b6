"""Limits what the event loop watches, as for a user who has no more watches."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import itertools
import os
from collections.abc import Iterator
from typing import Any

import pytest


@contextlib.contextmanager
def watches_left(left: int) -> Iterator[None]:
    """The running loop watches `left` more descriptors, and no others (ENOSPC, epoll_ctl(2))."""
    loop, numbers = asyncio.get_running_loop(), itertools.count()
    add_reader = loop.add_reader

    def refuse(descriptor: Any, *about: Any) -> None:
        if next(numbers) >= left:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        add_reader(descriptor, *about)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(loop, "add_reader", refuse)
        yield
