"""What the host finds by the entry-point group `nondum.host`.

A host without a router loads this module and no more of the package, and nothing of Zenoh.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from nondum.host.config.host_config import HostConfig
from nondum.host.extension.hookspecs import FleetMember, MakeFleet, hookimpl

if TYPE_CHECKING:
    from nondum_host_zenoh.fleet import ZenohFleet


@hookimpl
def fleets(config: HostConfig) -> Mapping[str, MakeFleet]:
    """`zenoh`, where `[router]` names one."""
    router = config.router
    if not router.endpoints:
        return {}

    def made(member: FleetMember) -> ZenohFleet:
        from nondum_host_zenoh.fleet import ZenohFleet
        from nondum_host_zenoh.line import RouterAccess

        access = RouterAccess(
            router.fleet,
            router.endpoints,
            router.authorities,
            router.certificate,
            router.private_key,
        )
        return ZenohFleet(
            member.identity, member.trust, member.handler, access, on_event=member.on_event
        )

    return {"zenoh": made}
