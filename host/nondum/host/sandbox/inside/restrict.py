"""What a worker's process gives up before the plugin's first line, and never gets back."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping
from typing import Any

from nondum.host.sandbox.inside import kernel


def put_up(walls: Mapping[str, Any], ruleset: int | None) -> None:
    """Give up what `walls` says; Landlock's ruleset comes as a descriptor.

    `user`: another user's and group's id, or null; `groups` that it has beside.
    `keeps_capabilities`; `may_gain_privileges`, by running a file of another user.
    `filter`: base64 of `struct sock_filter`, or null.
    """
    if walls["user"] is not None:
        os.setgroups(walls["groups"])
        os.setresgid(walls["user"], walls["user"], walls["user"])
        os.setresuid(walls["user"], walls["user"], walls["user"])
    if not walls["keeps_capabilities"]:
        kernel.keep_capabilities()
    if not walls["may_gain_privileges"]:
        kernel.prctl(kernel.PR_SET_NO_NEW_PRIVS, 1)
    if ruleset is not None:
        kernel.restrict_to(ruleset)
        os.close(ruleset)
    if walls["filter"] is not None:
        kernel.filter_calls(base64.b64decode(walls["filter"]))
