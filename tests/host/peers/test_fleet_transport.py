"""How this host reaches others is for exactly one extension to say."""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from typing import NoReturn

import pytest
from tests.transport.peers.hosts import Servant

from nondum.host.config.host_config import HostConfig
from nondum.host.config.parsing import parse
from nondum.host.extension.hookspecs import FleetMember, MakeFleet, hookimpl
from nondum.host.extension.loading import Extensions
from nondum.host.peers.fleet_transport import chosen
from nondum.transport.fleet import Fleet, Mesh
from nondum.transport.peers import HostKeys, Identity, PeerRefused, Trust

pytestmark = pytest.mark.anyio
ROUTER = parse('[router]\nendpoints = ["tcp/127.0.0.1:7447"]\n', "host.toml", HostConfig())


def unused(what: object) -> NoReturn:
    raise AssertionError(what)


def mine(member: FleetMember) -> Fleet:
    unused(member)


@hookimpl
def mine_always(config: HostConfig) -> Mapping[str, MakeFleet]:
    return {"mine": mine}


@hookimpl
def mistaken(config: HostConfig) -> Mapping[str, MakeFleet]:
    raise ZeroDivisionError("a mistake")


def extended(fleets: Callable[[HostConfig], Mapping[str, MakeFleet]]) -> Extensions:
    """What ships, and an extension with this hook."""
    extensions, extension = Extensions([]), types.ModuleType("mine")
    extension.__dict__["fleets"] = fleets
    extensions.manager.register(extension, "mine")
    return extensions


async def test_hosts_are_linked_one_by_one_where_no_router_is_named() -> None:
    make = chosen(Extensions([]), HostConfig())
    identity = Identity("rover", HostKeys.generate())
    fleet = make(FleetMember(identity, Trust(), Servant(), unused, unused))
    assert isinstance(fleet, Mesh)
    assert fleet.key == identity.key
    await fleet.close()


def test_router_is_for_the_extension_that_uses_one() -> None:
    assert chosen(extended(mine_always), ROUTER) is mine


def test_router_that_no_extension_uses_is_refused() -> None:
    with pytest.raises(PeerRefused) as refused:
        chosen(Extensions([]), ROUTER)
    (problem,) = refused.value.problems
    assert (problem.code, problem.where) == ("ZENOH_MISSING", "router.endpoints")
    assert problem.fix == "pip install 'nondum[zenoh]'"


def test_extension_that_does_not_work_is_told_with_the_router_that_is_refused() -> None:
    with pytest.raises(PeerRefused) as refused:
        chosen(extended(mistaken), ROUTER)
    codes = [problem.code for problem in refused.value.problems]
    assert codes == ["ZENOH_MISSING", "EXTENSION_BROKEN"]


def test_two_ways_to_reach_the_same_hosts_are_refused() -> None:
    with pytest.raises(PeerRefused) as refused:
        chosen(extended(mine_always), HostConfig())
    (problem,) = refused.value.problems
    assert (problem.code, problem.have) == ("FLEET_AMBIGUOUS", "mine, mesh")
