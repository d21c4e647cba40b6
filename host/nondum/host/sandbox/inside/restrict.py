"""What a worker's process gives up before the plugin's first line, and never gets back."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping
from typing import Any

from nondum.host.sandbox.inside import kernel


def restrict(restrictions: Mapping[str, Any], ruleset: int | None) -> None:
    """Give up what `restrictions` says; Landlock's ruleset comes as a descriptor.

    `user`: another user's and group's id, or null; `groups` that it has beside.
    `keeps_capabilities`; `may_gain_privileges`, by running a file of another user.
    `filter`: base64 of `struct sock_filter`, or null.
    """
    if restrictions["user"] is not None:
        os.setgroups(restrictions["groups"])
        os.setresgid(restrictions["user"], restrictions["user"], restrictions["user"])
        os.setresuid(restrictions["user"], restrictions["user"], restrictions["user"])
    if not restrictions["keeps_capabilities"]:
        kernel.keep_capabilities()
    if not restrictions["may_gain_privileges"]:
        kernel.prctl(kernel.PR_SET_NO_NEW_PRIVS, 1)
    if ruleset is not None:
        kernel.restrict_to(ruleset)
        os.close(ruleset)
    if restrictions["filter"] is not None:
        kernel.filter_calls(base64.b64decode(restrictions["filter"]))
