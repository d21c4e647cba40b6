"""Hosts on real networks: several machines, as namespaces of this one."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from demo.namespaces import Network
from tests.transport.discovery.hosts import Host

pytestmark = pytest.mark.daemon


@pytest.fixture
def network() -> Iterator[Network]:
    with Network() as network:
        yield network


def test_hosts_on_one_network_find_each_other(network: Network) -> None:
    rover, base = (Host(machine) for machine in network.lan("rover", "base"))
    hint, other = rover.hears(base), base.hears(rover)
    assert (hint["name"], hint["source"], hint["interface"]) == ("base", "multicast", "lan0")
    assert "tcp://10.77.0.2:7410" in hint["addresses"]
    assert "tcp://10.77.0.1:7410" in other["addresses"]


def test_a_goodbye_ends_the_hint(network: Network) -> None:
    rover, base = (Host(machine) for machine in network.lan("rover", "base"))
    rover.hears(base)
    base.leave()
    rover.loses(base)
    assert rover.status()["hints"] == 0


def test_ten_hosts_that_boot_at_once_all_find_each_other(network: Network) -> None:
    machines = network.lan(*(f"host-{number}" for number in range(10)))
    hosts = [Host(machine) for machine in machines]
    for host in hosts:
        missing = {other.key for other in hosts if other is not host}
        while missing:
            missing.discard(host.next("hint")["key"])


def test_a_new_name_is_announced(network: Network) -> None:
    rover, base = (Host(machine) for machine in network.lan("rover", "base"))
    rover.hears(base)
    base.rename("camp")
    rover.next("hint", key=base.key, name="camp")


def test_a_restarted_host_has_another_epoch(network: Network) -> None:
    here, there = network.lan("rover", "base")
    rover, base = Host(here), Host(there)
    rover.hears(base)
    base.kill()
    Host(there, key=base.key, epoch=2)
    rover.next("hint", key=base.key, epoch=2)


class TestSeveralNetworks:
    def test_every_address_is_told_those_in_reach_first(self, network: Network) -> None:
        first, second = network.switch(), network.switch()
        here, there = network.machine("rover"), network.machine("base")
        network.plug(here, first, ipv6=False)
        network.plug(there, second, ipv6=False)  # unreachable from the rover, and announced first
        network.plug(there, first, ipv6=False)
        rover, base = Host(here), Host(there)
        assert rover.hears(base)["addresses"] == ["tcp://10.77.0.2:7410", "tcp://10.77.1.1:7410"]

    def test_a_cable_that_joins_two_networks_later_joins_the_hosts(self, network: Network) -> None:
        first, second = network.switch(), network.switch()
        here, there = network.machine("rover"), network.machine("base")
        network.plug(here, first)
        network.plug(there, second)
        rover, base = Host(here), Host(there)
        network.plug(here, second)
        rover.hears(base)
        base.hears(rover)

    def test_halves_of_a_network_that_meet_find_each_other(self, network: Network) -> None:
        """No link goes down, and no host starts: only announcing again and again can help."""
        here, there = network.lan("rover", "base")
        network.switches[0].split([there.cables[0]])
        rover, base = Host(here), Host(there)
        first_s = rover.announced_s()
        while rover.announced_s() < first_s + 3.0:  # the hurry of the start is over
            pass
        assert rover.status()["hints"] == 0
        network.switches[0].join()
        rover.hears(base)
        base.hears(rover)


class TestAddresses:
    @pytest.mark.parametrize("checks", [0, 1], ids=["ready at once", "checked by the kernel first"])
    def test_ipv6_of_the_link_alone_is_enough(self, network: Network, checks: int) -> None:
        switch = network.switch()
        here, there = network.machine("rover"), network.machine("base")
        for machine in (here, there):
            machine.set("net.ipv6.conf.default.accept_dad", checks)
        network.plug(here, switch, ipv4="")
        far = network.plug(there, switch, ipv4="")
        rover, base = Host(here), Host(there)
        rover.finds_addresses(base, {f"tcp://[{far.link_local()}%lan0]:7410"})

    def test_ipv6_may_be_switched_off(self, network: Network) -> None:
        switch = network.switch()
        here, there = network.machine("rover"), network.machine("base")
        for machine in (here, there):
            machine.set("net.ipv6.conf.all.disable_ipv6", 1)
            network.plug(machine, switch, ipv6=False)
        rover, base = Host(here), Host(there)
        rover.finds_addresses(base, {"tcp://10.77.0.2:7410"})

    def test_an_address_that_comes_after_the_start_is_found(self, network: Network) -> None:
        """As DHCP gives them; and the machine has no default route either."""
        switch = network.switch()
        here, there = network.machine("rover"), network.machine("base")
        network.plug(here, switch, ipv6=False)
        late = network.plug(there, switch, ipv4="", ipv6=False)
        rover, base = Host(here), Host(there)
        assert rover.status()["hints"] == 0
        late.give("10.77.0.9/24")
        rover.finds_addresses(base, {"tcp://10.77.0.9:7410"})

    def test_an_exchanged_address_is_told(self, network: Network) -> None:
        here, there = network.lan("rover", "base")
        for machine in (here, there):
            machine.set("net.ipv6.conf.lan0.disable_ipv6", 1)
        rover, base = Host(here), Host(there)
        rover.finds_addresses(base, {"tcp://10.77.0.2:7410"})
        there.cables[0].take("10.77.0.2/24")
        there.cables[0].give("10.77.0.77/24")
        rover.finds_addresses(base, {"tcp://10.77.0.77:7410"})

    def test_a_host_without_any_network_starts_and_is_found_later(self, network: Network) -> None:
        here, there = network.machine("rover"), network.machine("base")
        rover, base = Host(here), Host(there)
        assert rover.status()["problems"] == []
        switch = network.switch()
        network.plug(here, switch)
        network.plug(there, switch)
        rover.hears(base)
        base.hears(rover)


class TestLinks:
    def test_a_cable_that_is_pulled_and_put_back_changes_nothing(self, network: Network) -> None:
        here, there = network.lan("rover", "base")
        rover, base = Host(here), Host(there)
        rover.hears(base)
        there.cables[0].pull()
        there.cables[0].put_back()
        base.rename("camp")
        rover.next("hint", key=base.key, name="camp")

    def test_hosts_that_start_while_the_cable_is_out_find_each_other(
        self, network: Network
    ) -> None:
        here, there = network.lan("rover", "base")
        there.cables[0].pull()
        rover, base = Host(here), Host(there)
        there.cables[0].put_back()
        rover.hears(base)
        base.hears(rover)

    def test_one_deaf_host_is_found_by_the_other(self, network: Network) -> None:
        here, there = network.lan("rover", "base")
        there.cables[0].lose_received()
        rover, base = Host(here), Host(there)
        rover.hears(base)
        assert base.status()["hints"] == 0


class TestStaticHosts:
    def test_where_multicast_does_not_reach_asking_does(self, network: Network) -> None:
        here, there = network.lan("rover", "base")
        for machine in (here, there):
            machine.cables[0].without_multicast()
        rover, base = Host(here, static=["10.77.0.2"]), Host(there)
        hint = rover.hears(base)
        assert (hint["source"], hint["addresses"]) == ("static", ["tcp://10.77.0.2:7410"])
        assert rover.status()["static"][0]["name"] == "base"

    def test_a_host_that_comes_up_late_is_asked_until_it_answers(self, network: Network) -> None:
        here, there = network.lan("rover", "base")
        rover = Host(here, static=["10.77.0.2"], multicast=False)
        while not rover.status()["static"][0]["problem"]:
            pass
        rover.hears(Host(there, multicast=False))

    def test_a_host_beyond_a_router_is_found(self, network: Network) -> None:
        first, second = network.switch(), network.switch()
        here, there, router = (network.machine(name) for name in ("rover", "base", "router"))
        for machine, switch in ((here, first), (there, second), (router, first), (router, second)):
            network.plug(machine, switch)
        router.set("net.ipv4.ip_forward", 1)
        here.ip("route", "add", "default", "via", "10.77.0.2")
        there.ip("route", "add", "default", "via", "10.77.1.2")
        rover, base = Host(here, static=["10.77.1.1"]), Host(there)
        rover.finds_addresses(base, {"tcp://10.77.1.1:7410"})


def test_bridges_for_containers_are_left_alone(network: Network) -> None:
    here, there = network.lan("rover", "base")
    here.ip("link", "add", "docker0", "type", "bridge")
    here.ip("address", "add", "172.17.0.1/16", "dev", "docker0")
    here.ip("link", "set", "docker0", "up")
    rover, base = Host(here), Host(there)
    assert "tcp://172.17.0.1:7410" not in base.hears(rover)["addresses"]
    used = [row["interface"] for row in rover.status()["interfaces"] if row["is_looked_on"]]
    assert used == ["lan0"]


def test_more_interfaces_than_memberships_are_told_with_a_fix(network: Network) -> None:
    here = network.machine("rover")
    switch = network.switch()
    here.set("net.ipv4.igmp_max_memberships", 2)
    for _ in range(4):
        network.plug(here, switch, ipv6=False)
    rows = Host(here).status()["interfaces"]
    problems = [row["problem"] for row in rows if row["problem"]]
    assert [problem["code"] for problem in problems] == ["MULTICAST_MEMBERSHIPS"] * 2
    assert problems[0]["fix"] == "sysctl -w net.ipv4.igmp_max_memberships=8"


def test_another_host_with_the_same_key_is_reported(network: Network) -> None:
    here, there = network.lan("rover", "copy")
    rover = Host(here, epoch=1)
    copy = Host(there, key=rover.key, epoch=2)
    for host in (rover, copy):
        while not host.status()["problems"]:
            pass
        assert host.status()["problems"][0]["code"] == "IDENTITY_DUPLICATE"
        assert host.status()["hints"] == 0
