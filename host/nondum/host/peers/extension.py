"""Links from this host to each other one, as an extension."""

from __future__ import annotations

import functools
from collections.abc import Mapping

from nondum.host.config.host_config import HostConfig
from nondum.host.extension.hookspecs import MakeFleet, hookimpl


@hookimpl
def fleets(config: HostConfig) -> Mapping[str, MakeFleet]:
    """`mesh`, where no router is named."""
    if config.router.endpoints:
        return {}
    from nondum.host.peers.fleet_transport import linked  # ten megabytes, for hosts with peers only

    return {"mesh": functools.partial(linked, config.peers)}
