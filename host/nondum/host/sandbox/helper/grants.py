"""Devices that a component was granted, where this daemon's user may open them.

Root may open every node itself. Another user has the helper make a node for each grant, so that
being granted is what counts, and no group of the system's.
"""

from __future__ import annotations

import logging
import time
from pathlib import Path

from nondum.host.sandbox.helper.privileged import Privileged, privileged
from nondum.sdk.errors import NondumError

TIMES = 3
"""So often is a helper asked that does not answer in time: it may just be starting."""
PAUSE_S = 1.0
"""Between these: who hangs up at once is given a moment."""
_NOT_YET = frozenset({"HELPER_BUSY", "HELPER_SILENT"})
log = logging.getLogger(__name__)


def reachable(
    component: str,
    need: str,
    node: str,
    user: int | None = None,
    *,
    times: int = TIMES,
    by: Privileged | None = None,
) -> str:
    """The node of a granted device, or one that stands for it, for the daemon's user or that of a
    worker; `by` is who makes it. Blocks, for a minute at most: not for the loop."""
    by = by or privileged()
    for left in reversed(range(times)):
        try:
            return str(by.put_node(component, need, Path(node), user))
        except (NondumError, OSError) as error:  # the plugin will be told when it opens it
            log.warning("%s of %s may not be opened: %s", need, component, error)
            is_answer = not isinstance(error, NondumError) or error.code not in _NOT_YET
            if not left or is_answer or not Path(node).exists():
                break
            time.sleep(PAUSE_S)
    return node


def withdrawn(component: str, need: str) -> None:
    """Remove what was made for a grant. Blocks: not for the loop."""
    privileged().take_node(component, need)
