"""How this host reaches others is for exactly one extension to say."""

from __future__ import annotations

import types
from collections.abc import Mapping

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


def mine(member: FleetMember) -> Fleet:
    raise AssertionError(member)


def extended() -> Extensions:
    """What ships, and an extension that would reach peers whatever the configuration says."""

    @hookimpl
    def fleets(config: HostConfig) -> Mapping[str, MakeFleet]:
        return {"mine": mine}

    extensions = Extensions([])
    extensions.manager.register(types.SimpleNamespace(fleets=fleets), "mine")
    return extensions


async def test_hosts_are_linked_one_by_one_where_no_router_is_named() -> None:
    make = chosen(Extensions([]), HostConfig())
    identity, found = Identity("rover", HostKeys.generate()), []
    fleet = make(FleetMember(identity, Trust(), Servant(), found.append, lambda _: pytest.fail()))
    assert isinstance(fleet, Mesh)
    assert fleet.key == identity.key
    await fleet.close()


def test_router_is_for_the_extension_that_uses_one() -> None:
    assert chosen(extended(), ROUTER) is mine


def test_router_that_no_extension_uses_is_refused() -> None:
    with pytest.raises(PeerRefused) as refused:
        chosen(Extensions([]), ROUTER)
    (problem,) = refused.value.problems
    assert (problem.code, problem.where) == ("ZENOH_MISSING", "router.endpoints")
    assert problem.fix == "pip install 'nondum[zenoh]'"


def test_extension_that_does_not_work_is_told_with_the_router_that_is_refused() -> None:
    @hookimpl
    def fleets(config: HostConfig) -> Mapping[str, MakeFleet]:
        raise ZeroDivisionError("a mistake")

    extensions = Extensions([])
    extensions.manager.register(types.SimpleNamespace(fleets=fleets), "mine")
    with pytest.raises(PeerRefused) as refused:
        chosen(extensions, ROUTER)
    codes = [problem.code for problem in refused.value.problems]
    assert codes == ["ZENOH_MISSING", "EXTENSION_BROKEN"]


def test_two_ways_to_reach_the_same_hosts_are_refused() -> None:
    with pytest.raises(PeerRefused) as refused:
        chosen(extended(), HostConfig())
    (problem,) = refused.value.problems
    assert (problem.code, problem.have) == ("FLEET_AMBIGUOUS", "mesh, mine")
